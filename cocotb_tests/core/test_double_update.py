# SPDX-License-Identifier: BSD-3-Clause
"""Sampling and update at both extremes of the carrier: RTL equal to the golden model, edges where they belong, loss."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from cocotb_tests.support.core.closed_loop import close_loop, leg_runs
from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.runs import InGhdl, InVerilator
from fluxproof.cosim.scenarios import scenario
from fluxproof.plant import IMPOSED_SPEED, RISING, AveragedPlant, Inverter, Machine, SwitchingPlant, half_gates
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.drive_keys import DriveError
from golden_model.modulation import pwm_compare
from golden_model.registers import registers
from golden_model.units import to_si
from studies.board import double_update

CHANGES = (
    ("[core]\n", "[core]\nupdates_per_period = 2\nresidual = true\n"),
    ("sample_time_s = 100e-6", "sample_time_s = 50e-6"),
    ("current_bandwidth_hz = 500", "current_bandwidth_hz = 1250"),
)


@pytest.fixture(scope="module")
def twice(tmp_path_factory):
    """The file of paper 001's drive, updated twice a period, with the residual of the motor."""
    text = PAPER.read_text()
    for before, after in CHANGES:
        assert text.count(before) == 1
        text = text.replace(before, after)
    path = tmp_path_factory.mktemp("drive") / "twice.toml"
    path.write_text(text)
    return path


@pytest.mark.slow
def test_closed_loop_in_verilator(twice):
    """5,000 half periods with every event: 0 differences, and the edges of each leg where its half's duty puts them."""
    skip_without_ghdl5()
    summary, arrays, register_set = close_loop(InVerilator, twice, "everything", 100, key=" twice")
    assert summary["sample_to_duty_clocks"] == fluxproof.SAMPLE_TO_DUTY
    assert summary["differences"] == 0 and summary["periods_compared"] == 5000
    assert np.count_nonzero(arrays["observed_sat_q"]) > 100
    assert np.count_nonzero(arrays["observed_speed_limited"]) > 100
    assert np.count_nonzero(arrays["observed_residual_d"]) > 4000 and not arrays["observed_motor_differs"].any()
    for leg in range(3):
        check_edges(arrays, register_set, leg)


@pytest.mark.slow
def test_closed_loop_in_ghdl(twice):
    """300 half periods of the VHDL itself, at start and under load."""
    summary, arrays, _ = close_loop(InGhdl, twice, "short", 100, key=" twice", periods=300)
    assert summary["differences"] == 0 and summary["periods_compared"] == 300
    assert len(arrays["gate_edges"]) > 1500


def check_edges(arrays, register_set, leg: int):
    """One edge in each half, from the sample before it; no pulse below the minimum."""
    values, half = register_set.values, register_set.config.carrier_half
    edges = arrays["gate_edges"]
    assert not np.any(edges[:, 2] & (edges[:, 2] >> 3) & 7), "both gates of a leg are on"
    compare, off = arrays[f"observed_compare_{'abc'[leg]}"], (2 * 2140 * half, 2 * 2260 * half)
    whole = 0
    for start, stop, which in leg_runs(edges, leg, half):
        if stop > off[0] and start < off[1]:
            continue
        assert stop - start >= values.min_pulse - values.dead_time
        if which != "high":
            continue
        for clock, late, rising in ((start, values.dead_time, True), (stop, 0, False)):
            k, into = divmod(clock - late, half)
            if into == 0 or k < 2:
                continue  # at an extreme: one of the halves has duty 0 or 1
            assert (k % 2 == 0) == rising, "an edge in the wrong half"
            assert into == (half - compare[k - 1] if rising else compare[k - 1])
            whole += 1
    assert whole > 3000


def test_registers_follow_the_sample_time(twice):
    """Everything that counts samples halves its time; what belongs to the PWM period stays."""
    one, two = drives.load(PAPER), drives.load(twice)
    a, b = ({row.name: row.si for row in registers(d).rows} for d in (one, two))
    assert two.sample_time_s == one.sample_time_s / 2 and two.carrier_half == one.carrier_half
    for name in ("k_delay", "k_ahead", "t_s", "watchdog"):
        assert b[name] == pytest.approx(a[name] / 2)
    assert b["k_chord"] == pytest.approx(a["k_chord"] / 4) and b["k_speed"] == pytest.approx(2 * a["k_speed"])
    assert (a["double_update"], b["double_update"]) == (0, 1)
    assert (b["dead_time"], b["min_pulse"], b["v_comp_max"]) == (a["dead_time"], a["min_pulse"], a["v_comp_max"])


def test_half_a_period_must_hold_a_sample(twice):
    drive = drives.load(twice)
    assert drives.with_carrier(drive, fluxproof.SAMPLE_INTERVAL).carrier_half == fluxproof.SAMPLE_INTERVAL
    with pytest.raises(DriveError, match="updates_per_period = 2 each half has a sample"):
        drives.with_carrier(drive, fluxproof.SAMPLE_INTERVAL - 1)
    with pytest.raises(DriveError, match="half a PWM period"):
        dataclasses.replace(drive, control=dataclasses.replace(drive.control, sample_time_s=1e-4))


def test_any_two_halves_keep_the_minimum_pulse():
    """Whatever the neighbouring halves ask for, high and low pulses across an extreme are long enough or absent."""
    half, pulse = 40, 8
    made = {pwm_compare.leg(duty, pulse, 1, half) for duty in range(0, 65537, 64)}
    assert {0, half} < made
    for before in made:
        for after in made:
            high, low = before + after, 2 * half - before - after  # around the peak, around the valley
            assert high == 0 or high >= pulse
            assert low == 0 or low >= pulse
            # A neighbour of duty 0 or 1 leaves the half alone
            assert before in (0, half) or pulse <= before <= half - pulse


def test_dead_time_of_the_halves_is_common_to_the_legs(twice):
    """A half has one edge a leg, so legs with positive current lose in rising halves only, others gain in falling ones.

    The difference between the halves is common to the legs: the motor sees in each half the mean error of a period.
    """
    drive = drives.load(twice)
    machine, half_s, dead = Machine.from_mapping(vars(drive.machine)), drive.sample_time_s, 2e-6
    duties, i_d, u_dc = np.array([0.55, 0.48, 0.5]), 3.0, 563.0
    wanted = -4 / 3 * u_dc * dead / (2 * half_s)  # of a period: i_a > 0 > i_b, i_c
    clean = 2 / 3 * u_dc * (duties[0] - (duties[1] + duties[2]) / 2)
    switched = SwitchingPlant(machine, mode=IMPOSED_SPEED, i_d=i_d)
    averaged = AveragedPlant(machine, Inverter(dead_time_s=dead), mode=IMPOSED_SPEED, i_d=i_d)
    levels, waits = np.zeros(3), np.zeros(3)
    for k in range(4):
        half = RISING if k % 2 == 0 else -RISING
        switched.advance(*half_gates(duties, half, levels, waits, dead, half_s), u_dc, 0.0, half_s)
        averaged.advance(duties, u_dc, 0.0, half_s, half)
        for plant in (switched, averaged):
            assert plant.u_alpha_beta[0] - clean == pytest.approx(wanted, abs=1e-6)
    assert averaged.i_dq == pytest.approx(switched.i_dq, abs=2e-3)


def test_adaline_finds_the_loss(twice):
    """2 us of dead time, twice updated: the estimators find the leg voltage that it costs, and i_d becomes smooth."""
    drive = drives.load(twice)
    control = dataclasses.replace(drive.control, flux_mode=0, v_dead_eta=1e-4, v_dead_zeta=1e-3)
    drive = dataclasses.replace(drive, control=control)
    scene = scenario(drive, 1.4, rpm={0.0: 300}, load={0.0: 3.0}, start_rpm=300)
    seen = simulate(drive, registers(drive), scene, dead_time_s=2e-6).observed
    part = slice(-4000, None)
    loss = to_si("v_comp", (seen["v_comp"] + seen["v_dead"])[part].mean(), drive)
    assert loss == pytest.approx(2e-6 * 10e3 * 563.0, rel=0.03)
    ripple = to_si("i_d", seen["i_d"], drive)
    assert ripple[part].std() < 0.2 * ripple[2000:4000].std()


def test_bandwidth_and_margin():
    """3 kHz and 45 degrees at 10 kHz PWM, as the theory says; one update a period does not reach it."""
    response = {n: double_update.measure(double_update.made(n, 1250.0)) for n in (1, 2)}
    twice = response[2]
    assert twice.bandwidth_hz >= 3000.0 and twice.margin_deg >= 45.0
    theory = double_update.predicted(double_update.made(2, 1250.0), twice.hz)
    assert np.abs(twice.closed - theory).max() < 0.03
    assert response[1].margin_deg < 30.0 and response[1].bandwidth_hz < 3000.0
