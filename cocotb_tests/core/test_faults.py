# SPDX-License-Identifier: BSD-3-Clause
"""Faults: requirements of the protection, on the golden core, the VHDL in GHDL and the converted RTL."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER, edited, row_of
from cocotb_tests.support.needs import ghdl5_missing
from fluxproof.checkout import ROOT
from fluxproof.cosim import ghdl
from fluxproof.cosim.closed_loop import gate_words
from fluxproof.cosim.driven_plant import INPUT_PORTS
from fluxproof.cosim.golden_clock import SEEN, GoldenClock
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.drive_keys import DriveError
from golden_model.io import sample_latch
from golden_model.io.fault_latch import NAMES
from golden_model.registers import registers
from studies.faults import __main__ as faults
from studies.faults.bench import named, run, setup
from studies.faults.cases import cases, tour
from studies.faults.cores import GoldenCore, VerilatedClock

HALF = 64
DRIVE, SET = setup(HALF)
MIDDLE = dict.fromkeys(INPUT_PORTS, 0) | {f"adc_{x}": 32768 for x in "abc"} | {"adc_u_dc": 40000, "speed_mode_in": 1}


def column(rows, name):
    return rows[:, SEEN.index(name)]


def running_core(**changes):
    """A golden core whose gates switch, three samples old, at the begin of a period."""
    core = GoldenClock(SET.values._replace(**changes), SET.config)
    core.advance(1, enable=1)
    for _ in range(3):
        core.advance(4)
        core.advance(2 * HALF - 4, MIDDLE)
    assert core.running
    return core


@pytest.mark.parametrize("seed", range(3))
def test_no_strobe_disturbs_a_sample(seed):
    """Strobes at any time: accepted samples are at least the core's interval apart; the others are counted."""
    rng, core, strobes = np.random.default_rng(seed), running_core(fault_ignore=32767), 0
    near, before, entered = fluxproof.SAMPLE_INTERVAL, len(core.samples), []
    for _ in range(400):
        count, at = len(core.samples), core.clock
        strobes += 1
        rows = core.advance(int(rng.choice([1, 2, 30, near - 2, near - 1, near, near + 1, 120])), MIDDLE)
        if len(core.samples) > count:
            entered.append(at)
    assert np.diff(entered).min() == fluxproof.SAMPLE_INTERVAL
    assert strobes - (len(core.samples) - before) >= 50
    assert column(rows, "early_samples")[-1] == min(255, strobes - (len(core.samples) - before))
    assert named(column(rows, "fault_flags")[-1])[-1] == "early" and not column(rows, "tripped").any()


@pytest.mark.parametrize("watchdog", [130, 200, 1000])
def test_watchdog_in_clocks(watchdog):
    """Gates off two clocks after the watchdog time since the last sample; a sample in time restarts it."""
    core = running_core(watchdog=watchdog)
    core.advance(4)
    rows = core.advance(watchdog - 1, MIDDLE)
    assert not column(rows, "tripped").any()
    rows = core.advance(1500, MIDDLE)
    off = int(np.flatnonzero(column(rows, "tripped"))[0]) + 1
    assert off == watchdog + 2 and not gate_words(rows)[off - 1 :].any()
    assert named(column(rows, "first_fault")[-1]) == ["watchdog"]


@pytest.mark.parametrize("bit", range(7))
def test_each_fault_alone(bit):
    """A fault stops the gates, is reported, cannot be cleared while present, and is only reported if ignored."""
    bad = [
        {"adc_a": 62000},
        {"adc_b": 36000},
        {"adc_c": 65535},
        {"adc_u_dc": 900},
        {"adc_u_dc": 50000},
        {},
        None,
    ][bit]
    open_limits = {"i_trip": 511, "sum_trip": 511} if bit == 2 else {"sum_trip": 511} if bit == 0 else {}
    open_limits |= {"omega_trip": 511, "omega_away": 511}  # a code that jumps is a speed as well
    for ignored in (0, 1 << bit):
        core, code = running_core(fault_ignore=ignored, **open_limits), 0
        core.advance(4)
        for k in range(5):
            code = code + 5000 * (k + 1) if bit == 5 else 0
            sample = None if bad is None else MIDDLE | bad | {"position_code": code}
            rows = core.advance(2 * HALF, sample, clear_trip=0)
        assert named(column(rows, "fault_flags")[-1]) == [NAMES[bit]]
        assert bool(gate_words(rows).any()) == bool(ignored) == (not column(rows, "tripped")[-1])
        rows = core.advance(3 * 2 * HALF, clear_trip=1, enable=1) if bad is None else None
        if bad is not None:
            core.advance(1, sample, clear_trip=1)  # the cause is still there
            rows = core.advance(2 * HALF - 1, clear_trip=0)
        assert named(column(rows, "fault_flags")[-1]) == [NAMES[bit]]
        assert bool(gate_words(rows).any()) == bool(ignored)
        for _ in range(4):  # the cause goes: still off, until it is cleared
            rows = core.advance(2 * HALF, MIDDLE | {"position_code": code % 65536}, clear_trip=0)
        assert bool(gate_words(rows).any()) == bool(ignored)
        core.advance(1, clear_trip=1)
        core.advance(3, clear_trip=0)
        for _ in range(3):
            rows = core.advance(2 * HALF, MIDDLE | {"position_code": code % 65536})
        assert gate_words(rows).any() and not column(rows, "fault_flags").any()


def test_faults_are_not_latched_before_enable():
    """All registers zero, as after a reset: every fault is present, none is latched before enable."""
    core = GoldenClock(fluxproof.Registers(*([0] * len(fluxproof.Registers._fields))), SET.config)
    for _ in range(4):
        rows = core.advance(2 * HALF, MIDDLE)
    assert not column(rows, "fault_flags").any() and not column(rows, "tripped").any()
    core.registers = SET.values
    rows = core.advance(2 * HALF, MIDDLE)  # a sample that the new registers judge
    assert not column(rows, "tripped").any()
    for _ in range(4):
        rows = core.advance(2 * HALF, MIDDLE, enable=1)
    assert gate_words(rows).any()


def test_enable_has_no_effect_during_a_fault():
    core = GoldenClock(SET.values, SET.config)
    core.advance(4)
    bad = MIDDLE | {"adc_u_dc": 0}
    for _ in range(3):
        rows = core.advance(2 * HALF, bad, enable=0)
    for _ in range(5):
        rows = core.advance(2 * HALF, bad, enable=1)
        assert not gate_words(rows).any()
    assert column(rows, "fault_flags")[-1] and not column(rows, "running").any()


def test_tour_in_ghdl():
    """The VHDL in GHDL through eight faults: equal to the golden core in every clock."""
    generics = {name.upper(): value for name, value in SET.config._asdict().items()}
    folder = ghdl.run("fluxproof", "cocotb_tests.support.in_simulator.dut_faults", generics, {}, key="faults")
    problem = ghdl.failure(folder)
    assert problem is None, problem
    summary = json.loads((folder / "summary.json").read_text())
    flags = np.bitwise_or.reduce(summary["faults"])
    assert set(named(int(flags))) >= {
        "current_sum", "position", "watchdog", "trip", "early", "u_dc_low", "overspeed", "host_lost",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["current sensor lost", "strobe missing", "strobe too early", "bus collapses"])
def test_case_in_the_converted_rtl(name):
    reason = ghdl5_missing()
    if reason:
        pytest.skip(reason)
    drive, register_set = setup(faults.CARRIER_HALF)
    case = next(c for c in cases(2 * faults.CARRIER_HALF) if c.name == name)
    found = faults.row(case, run(case, VerilatedClock(register_set), drive, register_set))
    assert not found["problems"] and found["differences"] == 0
    assert found["samples_compared"] > 1000


def test_unexpected_response_is_reported():
    """The check itself: a case with a missing trip or a difference is reported as a problem."""
    case = dataclasses.replace(tour(), clears=(18,))
    outcome = run(case, GoldenCore(SET), DRIVE, SET)
    right = faults.row(case, outcome)
    assert right["clocks_to_off"] == 2 and right["first"] == ["current_sum"]
    for changed, word in (
        ({"trips": None}, "expected None"),
        ({"trips": "position"}, "first fault"),
        ({"rpm": 100.0}, "rpm"),
    ):
        problems = faults.row(dataclasses.replace(case, **changed), outcome)["problems"]
        assert any(word in line for line in problems), problems
    assert any("differ" in line for line in faults.row(case, dataclasses.replace(outcome, differences=1))["problems"])


def test_every_case_is_in_the_docs():
    table = (ROOT / "docs" / "faults.md").read_text()
    for case in cases(2 * faults.CARRIER_HALF):
        assert f"| {case.name}: {case.text} |" in table, f"{case.name}: run `make faults ARGS=--docs`"


def test_random_register_writes_keep_the_gates_safe():
    """Any value of any register at any clock, strobes and stops: never both gates on, off after a trip."""
    reason = ghdl5_missing()
    if reason:
        pytest.skip(reason)
    device, rng, runs = VerilatedClock(SET), np.random.default_rng(5), 0
    core, usual = device.core, SET.values._asdict()
    ports = [p for p in sample_latch.BLOCK.ports({"ADC_BITS": 16, "POSITION_BITS": 16}) if p.name != "run_in"]
    core.set_many({"enable": 1})
    for storm in range(30):
        for _ in range(40):
            name, port = list(fluxproof.REGISTERS.items())[rng.integers(len(fluxproof.REGISTERS))]
            core.set(name, int(rng.choice([port.fmt.lo, port.fmt.hi, rng.integers(port.fmt.lo, port.fmt.hi + 1)])))
            core.set_many({p.name: int(rng.integers(p.fmt.lo, p.fmt.hi + 1)) for p in ports} | {"sample_valid": 1})
            words = gate_words(core.trace(int(rng.integers(1, 90)), SEEN))
            core.set("sample_valid", 0)
            words = np.append(words, gate_words(core.trace(int(rng.integers(1, 90)), SEEN)))
            assert not np.any(words & words >> 3 & 7), "both gates of a leg are on"
        core.set_many({"enable": storm % 2, "trip": 1 - storm % 2})
        core.tick(1)
        core.set("trip", 0)
        if storm % 2 == 0:
            assert not gate_words(core.trace(600, SEEN)).any(), "a gate came on after a trip"
        core.set_many(usual | MIDDLE | {"enable": 1})
        for period in range(8):  # the position code needs three samples to be believed again
            core.set_many({"clear_trip": int(period == 4), "sample_valid": 1})
            core.tick(1)
            core.set_many({"clear_trip": 0, "sample_valid": 0})
            core.tick(2 * HALF - 1)
        runs += core.get("running")
        assert core.get("running") and not core.get("tripped"), f"storm {storm}: the core does not come back"
    assert runs == 30


def test_defaults_of_the_drive_file():
    """Calculated by hand: limit 5.23 A, range 12.5 A, bus 563 V of 500 V base, 16 bits, 20,000 clocks a period."""
    values = registers(drives.load(PAPER)).values
    assert values.i_trip == round(256 * 2 * 5.23 / 12.5) and values.sum_trip == round(256 * 0.2 * 5.23 / 12.5)
    assert (values.u_dc_min, values.u_dc_max) == (round(256 * 56.3 / 500), round(256 * 1.3 * 563 / 500))
    assert values.jump_max == round((4 / 65536 + 5e-4) * 8192) and values.watchdog == 30000
    assert (values.rail_samples, values.fault_ignore) == (3, 1 << 12)  # an open load: told


def with_protection(tmp_path, lines):
    return edited(tmp_path, None, text=f"{PAPER.read_text()}\n[protection]\n{lines}\n")


def test_protection_keys(tmp_path):
    path = with_protection(
        tmp_path, "current_trip_a = 8\nu_dc_max_v = 700\ntrip_watchdog = false\ntrip_u_dc_low = false"
    )
    assert (row_of(path, "i_trip").integer, row_of(path, "u_dc_max").integer) == (
        round(8 / 12.5 * 256),
        round(700 / 500 * 256),
    )
    assert row_of(path, "fault_ignore").integer == 0b1000001001000
    assert row_of(with_protection(tmp_path, "position_jump_rad = 0.01"), "jump_max").integer == 13
    assert row_of(with_protection(tmp_path, "watchdog_periods = 3"), "watchdog").integer == 60000


@pytest.mark.parametrize(("line", "words"), [
    ("current_trip_a = 5", r"current_trip_a = 5 is out of range: allowed is above the current limit, 5.23"),
    ("u_dc_min_v = 600", r"u_dc_min_v = 600 is out of range: allowed is below \[inverter\] dc_bus_v = 563 V"),
    ("regen_start_v = 500", r"regen_start_v = 500 is .* above \[inverter\] dc_bus_v = 563 V and below"),
    ("brake_on_v = 600\nregen_start_v = 590", r"regen_start_v = 590 is .* above brake_on_v = 600 V"),
    ("regen_start_v = 600\nregen_end_v = 740", r"regen_end_v = 740 .* above regen_start_v = 600 V"),
    ("brake_on_v = 735", r"brake_on_v = 735 is out of range: .* below u_dc_max_v = 731.9 V, which trips"),
    ("regen_end_v = 600", r"regen_end_v needs regen_start_v"),
    ("u_dc_max_v = 500", r"u_dc_max_v = 500 is out of range: allowed is above \[inverter\] dc_bus_v"),
    ("watchdog_periods = 1", "watchdog_periods = 1 is out of range: allowed is above 1 up to .*; trip_watchdog"),
    ("watchdog_periods = 200", "watchdog_periods = 200 is .* while the current rises by half its limit"),
    ("watchdog_periods = 1\ntrip_watchdog = false", "watchdog_periods = 1 is out of range: allowed is above 1$"),
    ("brake_on_v = 600\nbrake_off_v = 560", r"brake_off_v = 560 .* dc_bus_v = 563 V, which keeps the resistor on"),
    ("brake_on_v = 570", r"brake_on_v = 570 is out of range: allowed is above 580.4 V, .* is above .* 563 V"),
    ("brake_off_v = 580", "brake_off_v needs brake_on_v"),
    ("encoder_lost_v = 1e5", "encoder_lost_v = 100000 is .* the EMF at rated speed"),
    ("rail_samples = 16", "rail_samples = 16 is out of range: allowed is 1 up to 15"),
    ("watchdog = 3", "unknown key watchdog; the nearest known one is trip_watchdog"),
])  # fmt: skip
def test_contradictions_are_refused(tmp_path, line, words):
    """Also what is valid and blinds a protection, or keeps the brake resistor on."""
    with pytest.raises(DriveError, match=words):
        drives.load(with_protection(tmp_path, line))
