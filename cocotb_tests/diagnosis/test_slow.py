# SPDX-License-Identifier: BSD-3-Clause
"""Slow logs: selection of stretches, contents of a block, and which effects are named, excluded and ambiguous."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.slow_logs import LEVELS, NOMINAL, Truth, log
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.slow_stretches import Stretches, message_period, stretches
from fluxproof.diagnosis.balance.slow_view import alike, slow_view
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground import constants
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.inference.posterior import possible
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.physics import explain
from studies.real.splits import axis_misfit, bounds, estimates_of, flux_map_of

PSI, L_Q = NOMINAL.machine.magnet_flux_wb, NOMINAL.machine.inductance_q_h
SEVERAL = Truth(v_dead=7.0, psi_m=0.92 * PSI, l_q=1.25 * L_Q, offset=0.06)


@pytest.fixture(scope="module")
def several():
    return explain([log(SEVERAL)], NOMINAL)


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


def test_value_without_update_is_not_used():
    recording = log()
    frozen = recording["t"] > 0.5 * recording["t"][-1]
    recording.columns["i_q"][frozen] = -111.0
    recording.columns["i_d"][frozen] = 0.5
    found = stretches(recording, NOMINAL)
    assert len(found) and not frozen[found.first].any()


def test_ramps_alone_are_refused_in_one_line():
    recording = log(levels=[(-500.0, 0.0), (-1800.0, -300.0)] * 8, hold_s=0.01)
    with pytest.raises(RecordingError, match="steady") as refused:
        explain([recording], NOMINAL)
    assert "\n" not in str(refused.value)


def test_few_operating_points_name_few_effects():
    answer = explain([log(Truth(psi_m=0.95 * PSI), levels=LEVELS[:3])], NOMINAL)
    assert [e.name for e in answer.effects] == ["magnet_flux"] and not answer.ambiguity
    assert any("With 3 operating points" in note for note in answer.notes)
    several = explain([log(SEVERAL, levels=LEVELS[:3])], NOMINAL)
    assert several.verdict == "unexplained" and not several.effects


def test_speed_is_needed():
    recording = log()
    del recording.columns["omega_e"]
    with pytest.raises(RecordingError, match="omega_e"):
        slow_view(recording, NOMINAL)


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


@pytest.mark.parametrize("seed", range(3))
def test_healthy_drive_is_healthy(seed):
    answer = explain([log(seed=seed)], NOMINAL)
    assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity


def test_four_effects_at_once_are_named(several):
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
    best = several.search.best()
    found = estimates_of(best)
    for name, truth in (("v_dead_v", 7.0), ("magnet_flux_wb", 0.92 * PSI), ("offset_rad", 0.06)):
        value, sigma, _ = found[name]
        assert abs(value - truth) < max(4.0 * sigma, 0.02 * truth), name


def test_held_out_points_are_predicted(several):
    held = axis_misfit(several.search.best(), several.held)
    for axis in "dq":
        assert held[axis]["after"] < 0.1 * held[axis]["before"]
        assert held[axis]["after"] < 3.0 * several.fit.noise_floor


def test_absent_effects_are_bounded(several):
    added = bounds(several.search)
    value, sigma, unit = added["resistance"]["parameters"]["resistance_ohm"]
    assert unit == "ohm" and abs(value - NOMINAL.machine.resistance_ohm) < 4.0 * sigma
    assert all(entry.get("log_odds", -1.0) < 0.0 for entry in added.values())
    assert any("harmonics" in note for note in several.notes)


def test_flux_map_of_the_model_is_the_logs(several):
    chart = flux_map_of(several.search.best())
    n = len(chart.i_q_a) // 2
    assert chart.psi_d_wb[len(chart.i_d_a) // 2, n] == pytest.approx(0.92 * PSI, rel=0.01)
    slope = (chart.psi_q_wb[len(chart.i_d_a) // 2, 0] - 0.0) / chart.i_q_a[0]
    assert slope == pytest.approx(1.25 * L_Q, rel=0.03)
    assert chart.folds() == 0


def test_absurd_sizes_are_impossible():
    view = slow_view(log(Truth(l_q=6.0 * L_Q)), NOMINAL)
    alone = Problem(Setup(view, view.visible(CATALOGUE), np.ones(len(view), bool))).fit(("inductance_q",))
    assert not possible(alone)


@pytest.mark.parametrize("share, costs", [(0.95, False), (0.5, True)])
def test_an_implausible_value_costs(share, costs, monkeypatch):
    """Else a sum of absurd effects that cancel is preferred to the true ones."""
    view = slow_view(log(Truth(psi_m=share * PSI), levels=LEVELS[:8]), NOMINAL)
    problem = Problem(Setup(view, view.visible(CATALOGUE), np.ones(len(view), bool)))
    priced = problem.fit(("magnet_flux",)).value
    monkeypatch.setattr(constants, "IMPLAUSIBLE", 1.0)
    assert problem.fit(("magnet_flux",)).value - priced == pytest.approx(np.log(1e3) * costs)


def test_readings_of_two_temperatures_are_no_noise():
    """Rows at one speed and current differ by the temperature of the winding, which is a condition of its own."""
    points = Stretches(**{name: np.full(12, x) for name, x in dict(i=-90j, u=20j, omega=-500.0, u_dc=400.0).items()},
                       temp=np.repeat([20.0, 60.0, 100.0], 4), t=np.arange(12.0), first=np.arange(12),
                       end=np.arange(1, 13), unsteady=np.zeros(12), rest=np.full(12, np.nan), window_s=1.0)  # fmt: skip
    moved = replace(points, omega=np.tile([-500.0, -900.0, -1400.0, -1800.0], 3))
    _, dwell = alike(moved, NOMINAL)
    assert len(np.unique(dwell)) == 12
    assert len(np.unique(alike(replace(moved, temp=np.full(12, np.nan)), NOMINAL)[1])) == 4
