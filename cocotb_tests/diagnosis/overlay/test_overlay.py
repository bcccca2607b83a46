# SPDX-License-Identifier: BSD-3-Clause
"""The simulation laid over a recording, of the drive file and of the improved one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.signal import savgol_filter

from cocotb_tests.support.drives import PAPER
from fluxproof.cosim.driven_plant import described_sensors
from fluxproof.cosim.scenarios import RPM, scenario, steps
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError, from_columns
from fluxproof.diagnosis.ground.result import Fit, NamedEffect
from fluxproof.diagnosis.improve.improve import plant_of, write_improved
from fluxproof.diagnosis.overlay.compare import closed_loop, is_worse
from fluxproof.diagnosis.overlay.inputs import SMOOTH_ROWS, dq_currents, smooth
from fluxproof.diagnosis.replay.capture import capture
from fluxproof.diagnosis.replay.telemetry import read_dump, write_dump
from fluxproof.plant import (
    IMPOSED_SPEED,
    Harmonic,
    Inverter,
)
from golden_model import drive as drives
from golden_model.registers import registers


def effect(plant, name="effect", **parameters):
    return NamedEffect(name, 0.99, parameters, 0.9, plant)


def recorded_drive(machine, inverter, sensors=None, seconds=1.2, noise=0.02):
    """A recording of the core on a drive that is not the nominal one: three loads at four speeds."""
    drive = drives.load(PAPER)
    register_set = registers(drive)
    changes = {0.0: 0.5, 0.1: 3.0, 0.2: 5.0}
    part = seconds / 4
    i_q = {k * part + t * part / 0.3: v * (-1 if k == 2 else 1) for k in range(4) for t, v in changes.items()}
    speeds = {0.0: 60, part: 700, 2 * part: -500, 3 * part: 1100}
    described = described_sensors(drive)
    sensors = dataclasses.replace(sensors or described, current_noise_a=noise)
    plan = scenario(drive, seconds, rpm={}, i_q=i_q, i_d={0.0: 0.0, part * 1.5: -2.0}, torque_mode=((0.0, 9.0),))
    turning = np.convolve(np.pad(steps(len(plan), speeds, 1e-4), 200, "edge"), np.full(401, 1 / 401), "valid") * RPM
    plan = dataclasses.replace(plan, load=turning, omega_m=turning[0])
    samples, observed, _ = capture(drive, register_set, plan, machine, inverter, sensors, IMPOSED_SPEED)
    return samples, observed, drive, register_set


LEGS = Inverter(dead_time_s=2e-6, zero_current_a=0.1)  # as the nominal drive has it, and what a leg does near zero


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    """A recording of the nominal drive."""
    nominal = load_nominal(PAPER)
    samples, observed, drive, register_set = recorded_drive(plant_of(nominal).machine, LEGS)
    path = write_dump(tmp_path_factory.mktemp("dump") / "a.dump", drive, register_set, samples, observed)
    return nominal, from_columns(read_dump(path)[0], 1e-4)


EFFECTS = {
    "resistance": ({"resistance_ohm": 1.9}, LEGS, {}, {"machine.resistance_ohm": 1.9}),
    "magnet": ({"magnet_flux_wb": 0.155}, LEGS, {}, {"machine.magnet_flux_wb": 0.155}),
    "saturation": ({"saturation_q_per_a2": 0.008}, LEGS, {}, {"machine.saturation_q_per_a2": 0.008}),
    "dead_time": ({}, dataclasses.replace(LEGS, dead_time_s=4e-6), {}, {"inverter.dead_time_s": 4e-6}),
    "encoder": ({}, LEGS, {"position_offset_rad": 0.02}, {"sensors.position_offset_rad": 0.02}),
    "offset": ({}, LEGS, {"current_offset_a": (0.3, -0.2, 0.1)}, {"sensors.current_offset_a": [0.3, -0.2, 0.1]}),
    "gain": ({}, LEGS, {"current_gain_error": (0.1, 0.1, 0.1)}, {"sensors.current_gain_error": [0.1] * 3}),
    "bus": ({}, LEGS, {"u_dc_gain_error": 0.06}, {"sensors.u_dc_gain_error": 0.06}),
    "harmonics": (
        {"emf_harmonics": (Harmonic(6.0, 0.02, 0.03, 0.4),)}, LEGS, {},
        {"machine.emf_harmonics": [[6, 0.02, 0.03, 0.4]]},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", list(EFFECTS))
def test_improved_drive_reproduces_the_recording(name, healthy, tmp_path):
    """With the effect, the simulation is as close to the recording as that of the healthy drive to its own."""
    nominal, own = healthy
    machine, legs, sensors, plant = EFFECTS[name]
    made = recorded_drive(
        dataclasses.replace(plant_of(nominal).machine, **machine),
        legs,
        dataclasses.replace(plant_of(nominal).sensors, **sensors),
    )
    samples, observed, drive, register_set = made
    columns, _ = read_dump(write_dump(tmp_path / "a.dump", drive, register_set, samples, observed))
    found = [effect(plant), effect({"inverter.zero_current_a": 0.1})]
    improved = write_improved(nominal, found, tmp_path / "improved.toml")
    data = closed_loop(from_columns(columns, 1e-4), nominal, improved)
    floor = closed_loop(own, nominal)["rms_before"]
    before, after = (np.hypot(data[run]["u_d_ref"], data[run]["u_q_ref"]) for run in ("rms_before", "rms_after"))
    least = np.hypot(floor["u_d_ref"], floor["u_q_ref"])
    assert least < 2.0, "volts, on a drive of several hundred"
    # The core's own compensation of the dead time and its flux estimator answer to these two; the float loop has none.
    assert after < {"dead_time": 2.0, "harmonics": 1.4}.get(name, 1.2) * least
    assert before > 1.2 * after
    assert len(data["t"]) <= 4000 and data["rows"] <= 20000 and (np.diff(data["t"]) > 0).all()
    for run in ("recorded", "simulated_before", "simulated_after"):
        assert all(len(v) == len(data["t"]) and np.isfinite(v).all() for v in data[run].values())


def test_a_late_angle_is_that_of_an_earlier_instant(healthy, tmp_path):
    """The recording has an angle that is 0.4 ms old; with it in the drive file the simulation meets the voltages."""
    nominal, own = healthy
    columns = {**own.columns, "theta_e": own["theta_e"] - 4e-4 * own["omega_e"]}
    improved = write_improved(nominal, [effect({"timing.angle_delay_s": 4e-4})], tmp_path / "improved.toml")
    data = closed_loop(from_columns(columns, 1e-4), nominal, improved)
    before, after = (np.hypot(data[run]["u_d_ref"], data[run]["u_q_ref"]) for run in ("rms_before", "rms_after"))
    assert before > 1.5 * after


def typical(data):
    return np.median(np.abs(data["simulated_before"]["u_q_ref"] - data["recorded"]["u_q_ref"]))


def test_overlay_with_missing_columns(healthy):
    """Without phases, references and angle, and as operating points of a slow log."""
    nominal, own = healthy
    whole = closed_loop(own, nominal)
    volts = {k: np.interp(own["t"], whole["t"], whole["recorded"][k]) for k in ("u_d_ref", "u_q_ref")}
    currents = dq_currents(own)
    columns = {
        "t": own["t"],
        "omega_e": own["omega_e"],
        "i_d": currents[:, 0],
        "i_q": currents[:, 1],
        **volts,
    }
    few = closed_loop(from_columns(columns, 1e-4), nominal)
    # Steps of the reference are smoothed away with the noise, so the typical difference counts.
    assert typical(few) < 1.5 and "simulated_after" not in few
    # One row each 10 ms, means as a slow logger gives them.
    slow = from_columns({k: v.reshape(-1, 100).mean(axis=1) for k, v in columns.items()}, 1e-2)
    slow.slow = True
    points = closed_loop(slow, nominal)
    assert len(points["t"]) == 66 and typical(points) < 3.0
    for missing in (("omega_e",), ("i_d",), ("u_d_ref",)):
        with pytest.raises(RecordingError):
            closed_loop(from_columns({k: v for k, v in columns.items() if k not in missing}, 1e-4), nominal)
    holed = {k: v.copy() for k, v in columns.items()}
    for name in ("omega_e", "i_q", "u_d_ref"):
        holed[name][1000:1003] = np.nan
    holed = closed_loop(from_columns(holed, 1e-4), nominal)
    assert np.isfinite(holed["simulated_before"]["u_q_ref"]).all() and holed["rms_before"]["u_q_ref"] < 6.0
    with pytest.raises(RecordingError, match="consecutive rows"):
        closed_loop(from_columns(columns, 2e-4), nominal)


@pytest.mark.parametrize("after, worse", [(0.5, False), (2.1, False), (3.0, True)])
def test_a_worse_drive_is_not_advised(after, worse):
    """Beside the noise of the balance: a measurement error leaves the loop as it was."""
    rms = lambda volts: {"u_d_ref": 0.0, "u_q_ref": volts}  # noqa: E731
    fit = Fit(noise_floor=0.1)
    assert is_worse({"rms_before": rms(2.0), "rms_after": rms(after)}, fit) is worse
    assert not is_worse({"rms_before": rms(2.0)}, fit) and not is_worse(None, fit)


def test_references_are_smoothed_by_local_parabolas():
    """As by the filter of Savitzky and Golay, at the ends too."""
    values = np.cumsum(np.random.default_rng(1).standard_normal(300))
    np.testing.assert_allclose(smooth(values), savgol_filter(values, SMOOTH_ROWS, 2), atol=1e-9)
    np.testing.assert_array_equal(smooth(values[: SMOOTH_ROWS - 1]), values[: SMOOTH_ROWS - 1])
