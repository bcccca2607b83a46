# SPDX-License-Identifier: BSD-3-Clause
"""Limits that hold: what a drive described wrongly or asked for too much ends in, golden core on the switching plant.

The same values go through the VHDL and the converted RTL in the tours of faults and the closed loops.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from cocotb_tests.support.core.limits import DRIVE, QUARTER, SET, first, play, told
from cocotb_tests.support.slow import slowly
from fluxproof.checkout import DRIVES, ROOT
from fluxproof.cosim.driven_plant import bus_of
from fluxproof.cosim.golden_clock import GoldenClock
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.scenarios import RPM, scenario
from golden_model import drive as drives
from golden_model.control import current_limit
from golden_model.formats import LIMIT
from golden_model.io import motion_checks
from golden_model.io.fault_latch import NAMES
from golden_model.io.sample_checks import IGNORE
from golden_model.protection_limits import regen_end_v
from golden_model.registers import registers
from golden_model.scaling import PARTS
from golden_model.units import from_si, one_is, to_si


@pytest.mark.parametrize("rpm, turned", [
    slowly(300.0, 1.1), (-300.0, 2.0), slowly(300.0, 2.9), slowly(-300.0, 1.1), slowly(300.0, 2.0), slowly(-300.0, 2.9),
])  # fmt: skip
def test_wrong_angle_is_a_runaway(rpm, turned):
    """The rotor's angle 99, 180, 261 degrees off at 300 rpm: runaway is named below a third of the rated speed.

    The EMF says it before, as an encoder that is lost.  Exactly 90 degrees off there is no torque: a stall.
    """
    offset = SET.values.theta_offset + round(turned * QUARTER)
    changes = {"theta_offset": offset % (4 * QUARTER)}
    early = play(1300, rpm, changes=changes)
    assert first(early) == ["encoder_lost"] and not early.running[-1]
    result = play(1300, rpm, changes=changes | {"emf_samples": 0})
    assert first(result) == ["runaway"] and not result.running[-1]
    assert np.abs(early.plant["omega_m"]).max() < 0.5 * np.abs(result.plant["omega_m"]).max()
    assert np.abs(result.plant["omega_m"]).max() < DRIVE.machine.rated_speed_rad_s / 3
    assert np.abs(result.plant["i_a"]).max() < 2.0 * DRIVE.current_limit_a


def test_right_angle_off_is_a_stall():
    """90 degrees off: all current in the d axis, no torque."""
    result = play(700, 300.0, changes={"theta_offset": QUARTER, "stall_samples": 500})
    assert first(result) == ["stall"] and np.abs(result.plant["omega_m"]).max() < 1.0


@pytest.mark.parametrize("sign", [slowly(1), -1])
def test_torque_mode_without_load_ends_in_overspeed(sign):
    result = play(2000, i_q=sign * 1.0, start_rpm=sign * 3500.0)
    assert first(result) == ["overspeed"] and not result.running[-1]
    rated = DRIVE.machine.rated_speed_rad_s
    assert np.abs(result.plant["omega_m"]).max() < 1.25 * rated
    limit, speed = SET.values.omega_trip << 8, np.abs(result.observed["omega_me"])
    beyond = int(np.flatnonzero(speed >= limit + 1)[0])
    assert result.running[beyond] and not any(result.running[beyond + 3 :])


@pytest.mark.parametrize("i_d", [slowly(12.0), -12.0])
@pytest.mark.parametrize("i_q", [None, 9.0])
def test_current_stays_in_its_circle(i_d, i_q):
    """i_d_ref of 12 A with a limit of 7.1 A, alone and with i_q_ref beside it."""
    limit = from_si("i_d_ref", 7.1, DRIVE)
    result = play(1000, 600.0, i_d=i_d, i_q=i_q, changes={"i_max": limit, "i_trip": 511})
    o = result.observed
    assert told(result) == []
    settled = slice(300, None)
    assert abs(np.hypot(o["i_d"], o["i_q"])[settled].mean() - limit) < 0.01 * limit
    assert np.abs(np.hypot(result.plant["i_d"], result.plant["i_q"])[settled]).mean() < 7.1 * 1.01
    assert np.abs(o["i_q_ref"])[settled].max() <= 1


def test_references_never_leave_the_circle():
    """Random references and limits: i_d**2 + i_q**2 <= i_max**2 of every pair, in both modes."""
    rng, state = np.random.default_rng(3), current_limit.State()
    for _ in range(3000):
        i_max, i_d_ref = int(2 ** rng.uniform(0, 17)) - 1, int(rng.integers(-131072, 131072))
        state, _ = current_limit.step(state, i_d_ref, i_max)
        assert state.i_d**2 + state.i_q_max**2 <= i_max**2 < state.i_d**2 + (state.i_q_max + 1) ** 2
        assert state.i_d == max(-i_max, min(i_max, i_d_ref)) and state.i_q_max == math.isqrt(i_max**2 - state.i_d**2)


@pytest.mark.parametrize("phase", range(3))
def test_offset_of_a_sensor_is_named_before_the_gates_switch(phase):
    """0.1 A at rest, gates off: enable has no effect, current_offset is named; a right zero starts."""
    name = f"offset_{'abc'[phase]}"
    wrong = {name: getattr(SET.values, name) + round(0.1 / 12.5 * 32768)}
    result = play(120, 300.0, changes=wrong, off=80)
    assert first(result) == ["current_offset"] and not any(result.running)
    result = play(120, 300.0, off=80)
    assert result.running[-1] and told(result) == []


def test_ordinary_operation_does_not_trip():
    """Reversals at full torque, load steps at rest and at speed, a stop: nothing is told."""
    rpm = np.repeat([0.0, 1500.0, -1500.0, 100.0, -100.0, 0.0], 900)
    load = np.repeat([0.0, 0.0, 0.0, 3.7, -3.7, 3.7], 900)
    result = play(len(rpm), rpm, load=load)
    assert told(result) == [] and result.running[-1]
    assert np.abs(result.plant["omega_m"]).max() > 1400 * RPM


def test_a_load_that_drives_the_shaft_away_is_a_runaway():
    """More load than the limit of the current holds: the shaft is driven against its reference."""
    result = play(1500, 300.0, load=9.0)
    assert first(result) == ["runaway"]


def test_a_stall_trips_unless_it_is_ignored():
    changes = {"stall_samples": 300, "fault_ignore": SET.values.fault_ignore | 1 << NAMES.index("stall")}
    blocked = dict(rpm=1000.0, load=0.0, changes=changes)
    scenario = dict(periods=900, **blocked)
    result = play_blocked(**scenario)
    assert told(result) == ["stall"] and result.running[-1]
    result = play_blocked(**scenario | {"changes": changes | {"fault_ignore": 0}})
    assert first(result) == ["stall"] and not result.running[-1]


def stall_after(speeds, way_stall=500, stall_samples=100):
    """Samples until a shaft with these speeds [LSB] at the current limit is a stall; 0: it is none."""
    state = motion_checks.State()
    for k, omega in enumerate(speeds):
        state, (faults,) = motion_checks.step(
            state, int(omega), 5000, 1, 1, 0, 1, LIMIT.hi, LIMIT.hi, motion_checks.AWAY_HI, way_stall, stall_samples
        )
        if faults & 4:
            return k + 1
    return 0


def test_a_tremble_is_a_stall_a_start_and_a_reversal_are_none():
    """500 LSB/256 times samples in 100 samples: what counts is where the shaft gets to, not how fast it trembles."""
    k = np.arange(1000)
    amplitude = 0.9 * (500 << 8) * 2 * np.pi / 40  # of the speed, 40 samples a cycle: nearly the way of both sides
    assert 100 <= stall_after(amplitude * np.sin(2 * np.pi * k / 40)) < 140
    assert stall_after(0 * k) == 100
    least = 2 * (500 << 8) / 100**2  # LSB a sample: to the end of the way in this time from rest
    assert stall_after(1.05 * least * k) == 0 and stall_after(0.8 * least * k[:300]) == 100
    assert stall_after(2.1 * least * (k - 500.0)) == 0


def play_blocked(periods, rpm, load, changes):
    """The shaft held by a load that follows the torque: the machine's own torque at the limit."""
    torque = 1.5 * DRIVE.machine.pole_pairs * DRIVE.machine.magnet_flux_wb * DRIVE.current_limit_a
    ramp = np.minimum(1.0, np.arange(periods) / 10.0)
    return play(periods, rpm, load=torque * 1.0 * ramp, changes=changes | {"way_stall": 1 << 12, "omega_away": 511})


def open_core(carrying, **changes):
    """A golden core at 1500 rpm whose i_q_ref is given and whose currents are those of the ``carrying`` phases."""
    core = GoldenClock(SET.values._replace(**changes), SET.config)
    core.advance(1, enable=1)
    code, step = 0, 65536 * 25 // 10000
    amplitude = 2000
    for _ in range(500):
        theta = 2 * math.pi * 4 * code / 65536
        sample = {f"adc_{x}": 32768 for x in "abc"}
        for n, x in enumerate("abc"):
            if carrying >> n & 1:
                sample[f"adc_{x}"] += round(amplitude * math.sin(theta - 2 * math.pi * n / 3))
        sample |= {"adc_u_dc": round(563 / 1000 * 65536), "position_code": code, "omega_ref_in": 0, "i_d_ref_in": 0}
        sample |= {"i_q_ext_in": 20000, "speed_mode_in": 0, "temp_winding_in": 0, "temp_valid_in": 0}
        rows = core.advance(4)
        rows = core.advance(124, sample | {"clear_faults_in": 0})
        code = (code + step) % 65536
    return int(rows[-1, 5])


@pytest.mark.parametrize(("carrying", "expected"), [(7, False), (6, True), (5, True), (3, True), (0, False)])
def test_open_phase_is_told(carrying, expected):
    flags = open_core(carrying, sum_trip=511, fault_ignore=IGNORE.hi)
    assert bool(flags >> NAMES.index("open_load") & 1) == expected


def test_host_that_stops_writing_turns_the_gates_off():
    core = GoldenClock(SET.values._replace(heartbeat=5), SET.config)
    middle = {f"adc_{x}": 32768 for x in "abc"} | {"adc_u_dc": 36897, "position_code": 0}
    middle |= dict.fromkeys(("omega_ref_in", "i_d_ref_in", "i_q_ext_in", "speed_mode_in"), 0)
    middle |= dict.fromkeys(("temp_winding_in", "temp_valid_in", "clear_faults_in"), 0)
    core.advance(1, enable=1, host_write=1)

    def period(writes):
        core.advance(4, host_write=int(writes))
        return core.advance(124, middle, host_write=0)

    for _ in range(20):
        rows = period(True)
    assert rows[-1, 3] and not rows[-1, 5]
    for _ in range(4):
        rows = period(False)
    assert rows[-1, 3]
    for _ in range(3):
        rows = period(False)
    assert not rows[-1, 3] and rows[-1, 6] == 1 << NAMES.index("host_lost") and not rows[-1, 0] and not rows[-1, 1]
    core.advance(1, host_write=1)
    core.advance(1, host_write=0, clear_trip=1)
    core.advance(1, clear_trip=0)
    for _ in range(3):
        rows = period(True)
    assert rows[-1, 3] and not rows[-1, 5]


def test_brake_chopper_has_hysteresis_and_needs_samples():
    values = SET.values._replace(brake_on=round(650 / 500 * 256), brake_off=round(620 / 500 * 256))
    core = GoldenClock(values, SET.config)
    seen = []
    for volts in (600, 640, 660, 640, 625, 615, 640, 700):
        sample = {f"adc_{x}": 32768 for x in "abc"} | {"adc_u_dc": round(volts / 1000 * 65536), "position_code": 0}
        sample |= dict.fromkeys(("omega_ref_in", "i_d_ref_in", "i_q_ext_in", "speed_mode_in"), 0)
        sample |= dict.fromkeys(("temp_winding_in", "temp_valid_in", "clear_faults_in"), 0)
        core.advance(4)
        seen.append(int(core.advance(124, sample)[-1, 9]))
    assert seen == [0, 0, 1, 1, 1, 0, 0, 1]
    assert core.advance(400)[-1, 9] == 0, "no samples: the resistor stays on"


def test_units_of_the_registers_are_the_scales():
    """What SystemRDL says 1.0 of a register is, evaluated with the bases, is the scale that the drive file uses."""
    drive = drives.load(ROOT / "docs" / "drives" / "emrax228.toml")
    b = drive.bases
    known = {"I_base": b.current_a, "U_base": b.voltage_v, "omega_base": b.omega_me_rad_s, "T_s": drive.sample_time_s}
    known |= {"clock_hz": drive.core.clock_hz, "pi": math.pi, "pole_pairs": drive.machine.pole_pairs}
    checked = 0
    for entry in (e for part in PARTS for e in part(drive)):
        says = one_is(entry.name, entry.unit).removesuffix("/K").removesuffix(" rad").removesuffix(" degC")
        if entry.unit in ("code", "turn"):
            continue
        assert eval(says, {"__builtins__": {}}, known) == pytest.approx(entry.scale, rel=1e-12), entry.name  # noqa: S307
        checked += 1
    assert checked > 60 and one_is("torque", "Nm") == "1.5*pole_pairs*I_base*U_base/omega_base"


def braked(seconds, to_rpm, friction_nm, **protection):
    """(drive, result) of the servo, without a brake resistor on 1 mF behind a diode, from 2,400 rpm to ``to_rpm``."""
    drive = drives.load(DRIVES / "servo_24v.toml")
    machine = dataclasses.replace(drive.machine, coulomb_friction_nm=friction_nm, viscous_friction_nms=0.0)
    protection = dataclasses.replace(drive.protection, brake_on_v=None, **protection)
    drive = dataclasses.replace(drive, machine=machine, protection=protection)
    moves = scenario(drive, seconds, rpm={0.0: 2400, 0.01: to_rpm}, start_rpm=2400)
    return drive, simulate(drive, registers(drive), moves, bus=bus_of(drive))


def named(result):
    """Names of the faults of samples and of motion in a run."""
    bits = np.bitwise_or.reduce(result.observed["sample_faults"])
    motion = np.bitwise_or.reduce(result.observed["motion_faults"])
    return [name for k, name in enumerate(NAMES) if bits >> k & 1] + [f"motion {motion}"] * bool(motion)


def test_the_bus_limits_the_braking_current():
    """A reversal that trips by u_dc_high: with the line the bus ends at it, and a coasting shaft is no runaway."""
    drive, result = braked(0.06, -2400, 0.0)
    assert named(result) == ["u_dc_high"]
    drive, result = braked(0.1, -2400, 0.0, regen_start_v=27.0)
    o, volts = result.observed, result.plant["u_dc"]
    assert named(result) == [] and 28.5 < volts.max() < regen_end_v(drive) + 0.1
    limited = o["regen_limited"] == 1
    assert limited.sum() * drive.sample_time_s > 0.08, "the bus stays full: no friction, the shaft coasts"
    assert (o["i_q_ref"] * o["omega_me"] <= 0)[limited].all()
    after = np.flatnonzero(limited)[0] + 100  # the line itself, in steady state
    most = drive.current_limit_a * np.clip((regen_end_v(drive) - volts) / (regen_end_v(drive) - 27.0), 0.0, 1.0)
    assert np.abs(np.abs(to_si("i_q_ref", o["i_q_ref"], drive)) - most)[after:][limited[after:]].max() < 0.1


def test_a_stop_on_a_full_bus_does_not_overshoot():
    """The speed regulator integrates no braking that the bus does not allow: the shaft does not run backwards."""
    drive, result = braked(0.36, 0, 0.02, regen_start_v=26.0, regen_end_v=27.0)
    rpm = result.plant["omega_m"] / RPM
    assert named(result) == [] and (result.observed["regen_limited"] == 1).sum() > 2000
    assert np.abs(rpm[-200:]).max() < 15.0 and rpm.min() > -15.0, "15 rpm: a twentieth of a count in a sample"
