# SPDX-License-Identifier: BSD-3-Clause
"""Slow logs: which effects are named, excluded and ambiguous."""

from __future__ import annotations

import pytest

from cocotb_tests.support.recordings.slow_logs import LEVELS, NOMINAL, Truth, log
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.physics import explain
from fluxproof.diagnosis.session import diagnose, work
from studies.real.splits import axis_misfit, bounds, estimates_of, flux_map_of

PSI, L_Q = NOMINAL.machine.magnet_flux_wb, NOMINAL.machine.inductance_q_h
SEVERAL = Truth(v_dead=7.0, psi_m=0.92 * PSI, l_q=1.25 * L_Q, offset=0.06)


@pytest.fixture(scope="module")
def several():
    return work(log(SEVERAL), NOMINAL)


def test_ramps_alone_are_refused_in_one_line():
    recording = log(levels=[(-500.0, 0.0), (-1800.0, -300.0)] * 8, hold_s=0.01)
    with pytest.raises(RecordingError, match="steady") as refused:
        explain([recording], NOMINAL)
    assert "\n" not in str(refused.value)


def test_few_operating_points_name_few_effects():
    answer = diagnose(log(Truth(psi_m=0.95 * PSI), levels=LEVELS[:3]), NOMINAL)
    assert [e.name for e in answer.effects] == ["magnet_flux"] and not answer.ambiguity
    assert any("With 3 operating points" in note for note in answer.notes)
    several = diagnose(log(SEVERAL, levels=LEVELS[:3]), NOMINAL)
    assert several.verdict == "unexplained" and not several.effects


@pytest.mark.parametrize("seed", range(3))
def test_healthy_drive_is_healthy(seed):
    answer = diagnose(log(seed=seed), NOMINAL)
    assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity


def test_four_effects_at_once_are_named(several):
    several = several.decision
    named = {e.name for e in several.effects} | {n for group in several.ambiguity for n in group}
    assert {"dead_time", "encoder_offset", "magnet_flux"} <= named
    assert named & {"inductance_q", "saturation"}
    assert not {e.name for e in several.effects} & {
        "resistance",
        "cross_saturation",
        "iron_loss",
        "current_scale",
    }


def test_parameters_are_those_of_the_log(several):
    best = several.decision.posterior.best()
    found = estimates_of(best)
    for name, truth in (("v_dead_v", 7.0), ("magnet_flux_wb", 0.92 * PSI), ("offset_rad", 0.06)):
        value, sigma, _ = found[name]
        assert abs(value - truth) < max(4.0 * sigma, 0.02 * truth), name


def test_held_out_points_are_predicted(several):
    held = axis_misfit(several.decision.posterior.best(), several.decision.basis.held)
    for axis in "dq":
        assert held[axis]["after"] < 0.1 * held[axis]["before"]
        assert held[axis]["after"] < 3.0 * several.decision.fit.noise_floor


def test_absent_effects_are_bounded(several):
    added = bounds(several.decision.posterior)
    value, sigma, unit = added["resistance"]["parameters"]["resistance_ohm"]
    assert unit == "ohm" and abs(value - NOMINAL.machine.resistance_ohm) < 4.0 * sigma
    assert all(entry.get("log_odds", -1.0) < 0.0 for entry in added.values())
    assert any("harmonics" in note for note in several.answer().notes)


def test_flux_map_of_the_model_is_the_logs(several):
    chart = flux_map_of(several.decision.posterior.best())
    n = len(chart.i_q_a) // 2
    assert chart.psi_d_wb[len(chart.i_d_a) // 2, n] == pytest.approx(0.92 * PSI, rel=0.01)
    slope = (chart.psi_q_wb[len(chart.i_d_a) // 2, 0] - 0.0) / chart.i_q_a[0]
    assert slope == pytest.approx(1.25 * L_Q, rel=0.03)
    assert chart.folds() == 0
