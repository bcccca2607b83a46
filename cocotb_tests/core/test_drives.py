# SPDX-License-Identifier: BSD-3-Clause
"""The drives of real motors in docs/drives: their front ends, `fluxproof simulate`, RTL against golden model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER, check_message
from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.checkout import DRIVES
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.runs import InVerilator, Named
from fluxproof.plant import Sensors, position_code, sensor_params
from golden_model.drive import DriveError, load, with_carrier
from golden_model.registers import registers
from golden_model.units import from_si

NAMES = ("servo_24v", "hub_36v", "spindle_400v", "drone_24v")


@pytest.mark.study
@pytest.mark.parametrize("name", NAMES)
def test_rtl_equals_golden_in_closed_loop(name):
    """400 periods of the converted RTL with the drive's plant: start, load, bus sag, torque mode, reversal, off."""
    skip_without_ghdl5()
    path = DRIVES / f"{name}.toml"
    job = InVerilator(f"test drive {name}", Named("fluxproof.cosim.runs:closed_loop", (str(path), 100, "tour")))
    job.carry_out()
    assert job.problem is None, job.problem
    summary, arrays = job.summary(), job.arrays()
    assert summary["differences"] == 0 and summary["periods_compared"] == 400
    assert not arrays["observed_sample_trip"].any() and arrays["observed_sat_q"].any()
    assert abs(arrays["plant_omega_m"]).max() > 0.2 * load(path).machine.rated_speed_rad_s


FRONT_ENDS = {  # text after the paper's drive, what the message must contain
    "kind": ('[encoder]\nkind = "abc"\n', '[encoder] kind = \'abc\'', "code, abz, hall, ssi, biss or endat", "abz"),
    "kind's type": ("[encoder]\nkind = 3\n", "[encoder] kind = 3", "a string"),
    "no counts": ('[encoder]\nkind = "abz"\n', "[encoder] counts is missing", 'kind = "abz" needs counts'),
    "counts": ('[encoder]\nkind = "abz"\ncounts = 3\n', "[encoder] counts = 3", "4 up to 262144"),
    "too many counts": ('[encoder]\nkind = "abz"\ncounts = 100000\n', "counts = 100000", "position_bits = 16"),
    "filter": ('[encoder]\nkind = "abz"\ncounts = 4000\nfilter_s = 1e-4\n', "filter_s = 0.0001", "at rated speed"),
    "phase": ('[encoder]\nkind = "abz"\ncounts = 4000\nindex_phase = 4\n', "index_phase = 4", "0 up to 3"),
    "foreign key": ('[encoder]\nkind = "hall"\ncounts = 6\n', "[encoder] counts = 6", 'kind = "hall" takes filter_s'),
    "no kind": ("[encoder]\ncounts = 4000\n", "[encoder] counts = 4000", 'kind = "code" takes no further key'),
    "no clock": ('[encoder]\nkind = "endat"\nbits = 25\n', "[encoder] clock_hz is missing", "needs bits, clock_hz"),
    "slow frame": ('[encoder]\nkind = "ssi"\nbits = 25\nclock_hz = 1e5\n', "clock_hz = 100000", "PWM period"),
    "monoflop": (
        '[encoder]\nkind = "ssi"\nbits = 25\nclock_hz = 3e5\n',
        "pause_s = 2e-05 s, ordinary for ssi, is out of range: allowed is up to 6.667e-06 s",
        "every second frame",
    ),
    "data sheet": (
        '[encoder]\nkind = "endat"\nbits = 25\nclock_hz = 1e6\npause_s = 60e-6\n',
        "pause_s = 6e-05 s is out of range: allowed is up to 5.2e-05 s",
    ),
    "fast frame": ('[encoder]\nkind = "ssi"\nbits = 25\nclock_hz = 3e7\n', "clock_hz = 30000000", "up to 20000000 Hz"),
    "ratio": ('[converters]\nkind = "spi"\nclock_hz = 30e6\n', "clock_hz = 3e+07", "nearest: 2.857143e+07 Hz and 3.33"),
    "slow spi": ('[converters]\nkind = "spi"\nclock_hz = 10e6\n', "clock_hz = 1e+07", "from 4 to 16"),
    "currents": ("[converters]\ncurrents = 1\n", "[converters] currents = 1", "2 up to 3"),
    "window": (
        '[converters]\nkind = "delta_sigma"\nclock_hz = 5e6\noversampling = 256\n', "oversampling = 256", "up to 166",
    ),
    "no window": ('[converters]\nkind = "delta_sigma"\nclock_hz = 5e6\n', "oversampling is missing", "needs clock_hz"),
}  # fmt: skip


@pytest.mark.parametrize("case", FRONT_ENDS)
def test_wrong_front_ends_give_a_one_line_error(tmp_path, capsys, case):
    text, *words = FRONT_ENDS[case]
    path = tmp_path / "drive.toml"
    path.write_text(f"{PAPER.read_text()}\n{text}")
    check_message(capsys, path, words)


def test_front_ends_of_the_drives_are_read():
    servo, spindle = (load(DRIVES / f"{name}.toml") for name in ("servo_24v", "spindle_400v"))
    assert (servo.encoder.kind, servo.encoder.counts, servo.converters.kind) == ("abz", 4000, "spi")
    assert (spindle.encoder.kind, spindle.encoder.bits, spindle.converters.oversampling) == ("endat", 25, 64)
    assert load(PAPER).encoder.kind == "code" and load(PAPER).converters.kind == "codes"


def test_counts_set_the_position_check():
    """Four counts of 4,000 and 5e-4 turn, where four codes of 65,536 would trip at every other count."""
    servo = load(DRIVES / "servo_24v.toml")
    jump = {row.name: row.represented for row in registers(servo).rows}["jump_max"]
    assert jump == pytest.approx(4 / 4000 + 5e-4, abs=2**-13)


def test_plant_reports_the_middle_of_a_count():
    """Every place of a turn is at most half a count and half a code from its code; both ends of a count agree."""
    sensors = sensor_params(Sensors(position_bits=16, position_counts=4000))
    for k in np.linspace(0.0, 1.0, 997, endpoint=False):
        away = position_code(sensors, 2 * np.pi * k, 0) / 65536 - k
        assert abs((away + 0.5) % 1.0 - 0.5) <= 0.5 / 4000 + 0.5 / 65536 + 1e-12
    inside = {position_code(sensors, 2 * np.pi * (17 + part) / 4000, 0) for part in (0.01, 0.5, 0.99)}
    assert inside == {round(17.5 * 65536 / 4000)}


def resolver(pairs: int):
    """emrax228, a motor of ten pole pairs, with a resolver of so many."""
    drive = load(DRIVES / "emrax228.toml")
    return replace(drive, sensors=replace(drive.sensors, position_bits=16, position_pole_pairs=pairs))


@pytest.mark.parametrize("pairs", [2, 5, 10])
def test_a_resolver_with_several_pole_pairs_gives_the_same_drive(pairs):
    """A start to 60 rpm against friction: angle, speed and current as with one pair, within codes."""
    seen = [_started(resolver(n)) for n in (1, pairs)]
    turned = [10 * np.cumsum(run.plant["omega_m"]) * resolver(1).sample_time_s for run in seen]  # electrical
    assert turned[0][-1] > 1.0 and np.abs(turned[0] - turned[1]).max() < 0.02
    for name, most in (("omega_me", 0.05), ("i_q", 0.05)):
        of_both = [run.observed[name] for run in seen]
        assert np.abs(of_both[0] - of_both[1]).max() < most * np.abs(of_both[0]).max(), name
    drive = resolver(pairs)
    jump = {row.name: row.represented for row in registers(drive).rows}["jump_max"]
    assert jump == pytest.approx(4 / 65536 + pairs * 5e-4, abs=2**-13)


def _started(drive):
    n, nothing = 600, np.zeros(600, np.int64)
    scenario = Scenario(
        omega_ref=nothing + from_si("omega_ref", 60 * np.pi / 30 * 10, drive), load=np.zeros(n), brake=np.full(n, 2.0),
        u_dc=np.full(n, drive.inverter.dc_bus_v), i_d_ref=nothing, i_q_ext=nothing, speed_mode=nothing + 1,
        enable=nothing + 1, theta_m=2.0,
    )  # fmt: skip
    return simulate(drive, registers(drive), scenario)


def test_a_resolver_that_does_not_tell_the_electrical_angle_is_refused():
    """Its pole pairs divide the motor's; what counts turns of the shaft needs a code of one turn."""
    for pairs in (3, 4, 20):
        with pytest.raises(DriveError, match="position_pole_pairs = .* a divisor of .*, 1, 2, 5, 10: "):
            resolver(pairs)
    drive = resolver(5)
    with pytest.raises(DriveError, match=r"1 with \[core\] position_loop"):
        replace(drive, core=replace(drive.core, position_loop=True))
    with pytest.raises(DriveError, match='kind = "abz", whose counts'):
        replace(drive, encoder=replace(drive.encoder, kind="abz", counts=4000))


def test_clock_accurate_simulations_drop_front_ends_with_clocks():
    """A slower clock for simulation would contradict the converters' clocks; the counts stay."""
    servo = with_carrier(load(DRIVES / "servo_24v.toml"), 100)
    assert servo.encoder.counts == 4000 and servo.converters.kind == "codes"
    assert with_carrier(load(DRIVES / "spindle_400v.toml"), 100).encoder.kind == "code"
