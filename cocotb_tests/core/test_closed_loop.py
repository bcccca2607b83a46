# SPDX-License-Identifier: BSD-3-Clause
"""The RTL in closed loop: equal to the golden model at every period; PWM timing on its own gate edges.

The long run is the converted RTL in Verilator; GHDL runs a shorter one on the VHDL itself with the same events.
"""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.core.closed_loop import close_loop, leg_runs
from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.cosim.runs import InGhdl, InVerilator
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.estimation import Estimated
from studies.timeline import __main__ as timeline


def test_everything_at_once():
    """One run of 2,500 periods of the converted RTL, looked at from several sides (one test: simulated once)."""
    skip_without_ghdl5()
    summary, arrays, register_set = close_loop(InVerilator, PAPER, "everything", 100)
    check_equal_at_every_period(summary, arrays)
    check_sensible_motion(arrays)
    for leg in range(3):
        check_pwm_timing(arrays, register_set, leg)


@pytest.mark.slow
def test_every_event_in_ghdl():
    """500 periods of the VHDL itself: voltage limit, speed limit, torque mode, reversal, gates off and on."""
    summary, arrays, _ = close_loop(InGhdl, PAPER, "compressed", 72)
    assert summary["differences"] == 0 and summary["periods_compared"] == 500
    assert summary["sample_to_duty_clocks"] == fluxproof.SAMPLE_TO_DUTY
    assert arrays["observed_sat_q"].any() and arrays["observed_speed_limited"].any()
    assert set(arrays["gate_edges"][:, 2] == 0) == {True, False}


def check_equal_at_every_period(summary, arrays):
    assert summary["sample_to_duty_clocks"] == fluxproof.SAMPLE_TO_DUTY
    assert summary["periods_compared"] >= 2000 and summary["differences"] == 0
    # The scenario must have been as hard as it claims.
    assert np.count_nonzero(arrays["observed_sat_q"]) > 100, "the voltage was never at its limit"
    assert np.count_nonzero(arrays["observed_speed_limited"]) > 100, "the speed regulator was never at its limit"
    assert arrays["plant_omega_m"].max() > 70 and arrays["plant_omega_m"].min() < -30
    assert np.abs(arrays["plant_torque"]).max() > 4


def check_sensible_motion(arrays):
    """Speed and current follow their references if nothing is at a limit: bit-exactness alone does not show it."""
    drive = drives.load(PAPER)
    i_q = arrays["observed_i_q"] * drive.bases.current_a / 2**16
    i_q_ref = arrays["observed_i_q_ref"] * drive.bases.current_a / 2**16
    loaded = slice(800, 890)
    assert np.abs(i_q[loaded] - i_q_ref[loaded]).max() < 0.3
    assert abs(arrays["plant_omega_m"][1950:2100].mean() * 30 / np.pi + 300) < 60


def check_pwm_timing(arrays, register_set, leg: int):
    """Dead time, symmetry, duty, update instant, minimum pulse: measured on edges, without the gate model."""
    values, half = register_set.values, register_set.config.carrier_half
    edges, period = arrays["gate_edges"], 2 * half
    assert not np.any(edges[:, 2] & (edges[:, 2] >> 3) & 7), "both gates of a leg are on"
    runs = leg_runs(edges, leg, period)
    compare = arrays[f"observed_compare_{'abc'[leg]}"]
    enable_gap = (2140 * period, 2260 * period)  # the scenario switches off here: gates stay off longer
    whole = 0
    for (_, stop, which), (start, _, following) in zip(runs, runs[1:], strict=False):
        if enable_gap[0] < stop < enable_gap[1]:
            continue
        assert which != following, "a gate pulsed twice without the other between"
        assert start - stop == values.dead_time
    for start, stop, which in runs:
        if enable_gap[0] < start < enable_gap[1] or stop > enable_gap[0] > start:
            continue
        assert stop - start >= values.min_pulse - values.dead_time
        k = start // period
        if which == "high" and k >= 2 and stop < (k + 1) * period:
            # The duty of the sample of the period before, around the middle of this one, on by dead time later.
            wanted = compare[k - 1]
            assert start - k * period == half - wanted + values.dead_time
            assert stop - k * period == half + wanted
            whole += 1
    assert whole > 1500


@pytest.mark.slow
def test_smallest_converters(tmp_path):
    """12-bit currents and a 12-bit resolver: the lower end of the generics."""
    text = (
        PAPER.read_text().replace("adc_bits = 16", "adc_bits = 12").replace("position_bits = 16", "position_bits = 12")
    )
    path = tmp_path / "coarse.toml"
    path.write_text(text)
    summary, _, register_set = close_loop(InGhdl, path, "short", 72, key=" coarse", periods=150)
    assert (register_set.config.adc_bits, register_set.config.position_bits) == (12, 12)
    assert summary["differences"] == 0 and summary["periods_compared"] == 150


@pytest.mark.slow
def test_without_estimators(tmp_path):
    """ESTIMATORS = 0: the same events, every value equal, what the estimators would show zero."""
    skip_without_ghdl5()
    path = tmp_path / "plain.toml"
    path.write_text(PAPER.read_text().replace("[core]\n", "[core]\nestimators = false\n"))
    summary, arrays, register_set = close_loop(InVerilator, path, "everything", 100, key=" no estimators")
    assert register_set.config.estimators == 0 and register_set.values.flux_mode == 3
    check_equal_at_every_period(summary, arrays)
    assert not any(arrays[f"observed_{name}"].any() for name in Estimated._fields)


@pytest.mark.slow
def test_braking_that_the_bus_limits(tmp_path):
    """The line of [protection] regen_start_v in RTL: met, down to no braking current, and left again."""
    skip_without_ghdl5()
    path = tmp_path / "regen.toml"
    path.write_text(f"{PAPER.read_text()}\n[protection]\nregen_start_v = 580\nregen_end_v = 640\n")
    summary, arrays, _ = close_loop(InVerilator, path, "braking", 100, key=" regen")
    limited = arrays["observed_regen_limited"] == 1
    assert summary["differences"] == 0 and summary["periods_compared"] == 300
    assert limited.sum() > 60 and (arrays["observed_i_q_ref"] == 0)[limited].any()
    assert len(np.unique(arrays["observed_i_q_ref"][limited])) > 5, "a line, not a switch"


@pytest.mark.slow
def test_bootstraps_are_charged_before_the_drive_switches(tmp_path):
    """[inverter] bootstrap_charge_s of four periods: the lower gates alone after enable, and after a stop."""
    skip_without_ghdl5()
    path = tmp_path / "charge.toml"
    path.write_text(PAPER.read_text().replace("[inverter]\n", "[inverter]\nbootstrap_charge_s = 3.5e-4\n"))
    summary, arrays, register_set = close_loop(InVerilator, path, "compressed", 100, key=" charge")
    assert register_set.values.charge_samples == 4
    assert summary["differences"] == 0 and summary["periods_compared"] == 500
    edges = arrays["gate_edges"]
    words = [0, *edges[:, 2]]
    starts = [k for k in range(len(edges)) if words[k] == 0 and words[k + 1] == 0b111000]
    charges = [k for k in starts if np.ptp(edges[k : k + 2, 0]) >= 3]  # nothing but the lower gates for three periods
    assert len(charges) == 2, "after enable and after the stop of the scenario"
    for k in charges:
        lasted = (edges[k + 1, 0] - edges[k, 0]) * 200 + edges[k + 1, 1] - edges[k, 1]
        assert 4 * 200 - register_set.values.dead_time <= lasted < 5 * 200


def test_timeline():
    """Every block starts when its last input is valid and has its declared latency, measured in the RTL."""
    measured = timeline.measure()
    planned = fluxproof.schedule()
    for part in set(fluxproof.PARTS) - {"estimators"}:  # only with their generics
        for label in set(fluxproof.PARTS[part]) - {"towards"}:
            del planned[label]
    # So is the direction of the reference, which the directions wait for.
    later = planned.pop("towards")[1] - planned["direction_functions"][1]
    planned["directions"] = tuple(clock - later for clock in planned["directions"])
    assert {row["instance"]: (row["first"], row["last"]) for row in measured["blocks"]} == planned
    assert measured["sample_to_duty_clocks"] == fluxproof.SAMPLE_TO_DUTY <= 40
