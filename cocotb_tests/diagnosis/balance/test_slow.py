# SPDX-License-Identifier: BSD-3-Clause
"""Slow logs: selection of stretches, contents of a block, and which effects are named, excluded and ambiguous."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.recordings.slow_logs import LEVELS, NOMINAL, Truth, log
from cocotb_tests.support.slow import slowly
from fluxproof.diagnosis.balance.messages import message_period
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.slow_stretches import Stretches, stretches, stretches_in_motion
from fluxproof.diagnosis.balance.slow_view import alike, slow_view
from fluxproof.diagnosis.balance.used import little_used
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError, from_columns
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.session import diagnose
from studies.brought import late
from studies.brought.drives import FOLDER, drive_of, true_machine
from studies.brought.motion import Logger, logged, ride
from studies.brought.moving import GAIT, THROTTLE


def test_stretches_lie_within_the_dwells():
    recording = log()
    found = stretches(recording, NOMINAL)
    steps = np.arange(len(LEVELS)) * 5.0
    inside = [np.any((recording["t"][a] >= steps) & (recording["t"][b - 1] <= steps + 4.6)) for a, b in
              zip(found.first, found.end, strict=True)]  # fmt: skip
    assert len(found) >= len(LEVELS) and all(inside)
    levels = {(round(w), round(q / 10) * 10) for w, q in zip(found.omega / 10, found.i.imag, strict=True)}
    assert {q for _, q in levels} == {0, -60, -120, -180}


def test_stretches_span_two_messages_of_the_slowest_signal():
    recording = log()
    assert message_period(recording["t"], recording["i_q"]) == pytest.approx(0.5, abs=0.04)
    assert stretches(recording, NOMINAL).window_s >= 0.9


def test_a_log_of_whole_messages_has_no_slow_signal():
    """The current of an idle drive rests now and then, which is no wait for a message."""
    rng, t = np.random.default_rng(5), 0.08 * np.arange(800)
    noisy = np.round(rng.normal(2.0, 0.3, 800), 2)
    idle = np.where(np.sin(0.3 * t) > 0.0, noisy, 0.0)
    idle[1::25] = idle[::25]  # a row as the one before
    assert message_period(t, idle) == pytest.approx(0.08)
    assert message_period(t, np.repeat(noisy[::4], 4)) > 0.2
    assert message_period(t, np.interp(t, t[::4], noisy[::4])) > 0.2


def test_value_without_update_is_not_used():
    recording = log()
    frozen = recording["t"] > 0.5 * recording["t"][-1]
    recording.columns["i_q"][frozen] = -111.0
    recording.columns["i_d"][frozen] = 0.5
    found = stretches(recording, NOMINAL)
    assert len(found) and not frozen[found.first].any()


def test_speed_is_needed():
    recording = log()
    del recording.columns["omega_e"]
    with pytest.raises(RecordingError, match="omega_e"):
        slow_view(recording, NOMINAL)


def test_a_log_that_is_too_short_says_how_long_it_lasts():
    """A module's log of 0.17 s whose sample time was missing was told that it is not steady."""
    t = 4e-4 * np.arange(425)
    noise = 0.01 * np.random.default_rng(3).normal(size=(4, 425))
    columns = {"i_d": noise[0], "i_q": 10.0 + noise[1], "u_d_ref": noise[2], "u_q_ref": 8.0 + noise[3]}
    short = from_columns({"t": t, **columns, "omega_e": np.full(425, 52.0)}, 1e-4, "module.csv")
    unstated = replace(NOMINAL, control=replace(NOMINAL.control, sample_time_s=None))
    with pytest.raises(RecordingError, match=r"lasts 0\.17 s.* takes 0\.5 s: .*every 0\.0004 s.*sample_time_s"):
        stretches(short, unstated)


def test_block_of_the_nominal_drive_has_no_misfit():
    view = slow_view(log(Truth(noise_v=0.0, noise_a=0.0)), NOMINAL)
    left = np.abs(misfit(view)["u"]).mean(axis=1)
    assert np.median(left) < 0.02 and left.max() < 0.5  # the speed's own noise; a stretch may touch a ramp


def test_mean_of_the_inverters_loss_is_that_of_a_whole_turn():
    view = slow_view(log(), NOMINAL)
    column = CATALOGUE["dead_time"].core(view)["v_0.02"]["u"].mean(axis=1)
    heavy = view.i[:, 0].imag < -100.0
    assert np.abs(column[heavy] + 1j * 4 / np.pi).max() < 0.01
    assert np.ptp(np.abs(column[heavy])) < 1e-3


def test_a_delay_turns_the_voltage_by_its_angle():
    view = slow_view(log(), NOMINAL)
    late = CATALOGUE["delay"].corrected(view, {"tau": view.sample_time_s})
    turned = (late.to_dq(late.u[:, 1:-1]) / view.to_dq(view.u[:, 1:-1])).mean(axis=1)
    assert np.angle(turned) == pytest.approx(-view.omega[:, 0] * view.sample_time_s, abs=1e-9)


def test_repetitions_share_a_dwell():
    view = slow_view(log(), NOMINAL)
    same = np.diff(view.run) == 0
    assert same.any()
    assert np.abs(np.diff(view.omega[:, 0]))[same].max() < 0.05 * np.abs(view.omega).max()
    assert np.abs(np.diff(view.i_raw[:, 0]))[same].max() < 0.05 * NOMINAL.machine.rated_current_a


def test_readings_of_two_temperatures_are_no_noise():
    """Rows at one speed and current differ by the temperature of the winding, which is a condition of its own."""
    points = Stretches(**{name: np.full(12, x) for name, x in dict(i=-90j, u=20j, omega=-500.0, u_dc=400.0).items()},
                       temp=np.repeat([20.0, 60.0, 100.0], 4), t=np.arange(12.0), first=np.arange(12),
                       end=np.arange(1, 13), unsteady=np.zeros(12), rest=np.full(12, np.nan), window_s=1.0)  # fmt: skip
    moved = replace(points, omega=np.tile([-500.0, -900.0, -1400.0, -1800.0], 3))
    _, dwell = alike(moved, NOMINAL)
    assert len(np.unique(dwell)) == 12
    assert len(np.unique(alike(replace(moved, temp=np.full(12, np.nan)), NOMINAL)[1])) == 4


def _gait(way, logger, **factors):
    """A recording of a ride with the servo drive of docs/drives, whose machine is off by factors."""
    drive = drive_of("servo_24v")
    rng = np.random.default_rng(50)
    machine, _ = true_machine(drive, **factors)
    i, omega, u = ride(machine, way, rng)
    columns = logged(i, omega, u, machine, drive["inverter"]["dc_bus_v"], logger, rng)
    return replace(from_columns(columns, logger.row_s), slow=True), load_nominal(FOLDER / "servo_24v.toml")


def test_gait_is_balanced_in_motion():
    """Steady stretches are too rare; the log itself shows the ages (-7 and -4 ms) and the resistance."""
    recording, nominal = _gait(replace(GAIT, seconds=40.0), Logger(0.02), resistance_ohm=1.3)
    found = stretches(recording, nominal)
    assert "current -7" in found.notes[0] and "speed -4" in found.notes[0]
    u = found.u - steady_voltage(nominal.machine, found.i, found.omega)
    share = np.sum(u.imag * found.i.imag) / np.sum(found.i.imag**2) / nominal.machine.resistance_ohm
    left = u - share * nominal.machine.resistance_ohm * found.i
    assert share == pytest.approx(0.3, abs=0.01) and np.sqrt(np.mean(np.abs(left) ** 2)) < 0.02


def test_age_that_the_rows_leave_open_is_a_common_error():
    """Where the load follows the speed, an age of the speed resembles a resistance with less flux."""
    recording, nominal = _gait(replace(THROTTLE, seconds=40.0), Logger(0.1))
    view = slow_view(recording, nominal)
    errors = view.common_errors()
    assert len(errors) == 5 and all(np.abs(e).max() > 0.0 for e in errors)
    assert len(slow_view(log(), NOMINAL).common_errors()) == 3


def test_held_messages_are_not_balanced_in_motion():
    recording, nominal = _gait(replace(GAIT, seconds=40.0), Logger(0.02))
    for name in ("i_q", "u_q_ref", "omega_e"):
        held = recording[name]
        recording.columns[name] = held[np.arange(len(held)) // 10 * 10]
    assert stretches_in_motion(recording, nominal) is None


@pytest.mark.parametrize(
    "kind, name, key",
    [
        ("filter", "delay", "delay_s"),
        slowly("angle", "delay", "angle_late_s"),
        slowly("iron", "iron_loss", "iron_resistance_ohm"),
    ],
)
def test_operating_points_show_what_is_late(kind, name, key, tmp_path):
    """All follow omega^2 on the d axis; a late angle was told as a late voltage beside a wrong inductance."""
    (chosen,) = [c for c in late.cases() if c.name == f"late.drone_24v_table_{kind}"]
    (recording,), drive = chosen.files(tmp_path)
    nominal = load_nominal(drive)
    answer = diagnose(load_recording(recording, nominal), nominal)
    low, high = chosen.truth.causes[0].sizes[key]
    assert [e.name for e in answer.effects] == [name] and not answer.ambiguity, answer.sentence
    assert low < answer.effects[0].parameters[key].value < high


def test_little_of_a_recording_is_told_with_the_reason():
    """23 of 162 blocks were compared without a word."""
    recording = log()
    slow_view(recording, NOMINAL)
    rows, steady, used = len(recording), recording.meta["rows_steady"], recording.meta["rows_used"]
    assert 0 < used <= steady < rows
    recording.meta |= {"rows_steady": rows // 2, "rows_used": rows // 4}
    recording.usable[: rows - rows // 2 - rows // 10] = False
    (found,) = little_used([recording])
    assert found.count == rows - rows // 4 and f"({rows // 4} of {rows})" in found.message
    assert "set aside by the checks" in found.action and "held long or repeated" in found.action
    assert not found.fatal and "10 % where current" in found.action, found.action
    recording.meta["rows_used"] = rows // 2 + 1
    assert little_used([recording]) == ()
