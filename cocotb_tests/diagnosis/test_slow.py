"""Slow logs: selection of stretches, contents of a block, and which effects are named, excluded and ambiguous."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.slow_logs import LEVELS, NOMINAL, Truth, log
from fluxproof.diagnosis.answer.slow_names import sorted_out
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.slow_stretches import message_period, stretches
from fluxproof.diagnosis.balance.slow_view import slow_view
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.inference.fit import Model
from fluxproof.diagnosis.inference.refine import IMPLAUSIBLE
from fluxproof.diagnosis.inference.slow_model import bounds, flux_map_of
from fluxproof.diagnosis.inference.slow_search import SlowSearch
from fluxproof.diagnosis.recording import RecordingError
from fluxproof.diagnosis.slow_diagnosis import axis_misfit, diagnose_slow, model_effects

PSI, L_Q = NOMINAL.machine.magnet_flux_wb, NOMINAL.machine.inductance_q_h
SEVERAL = Truth(v_dead=7.0, psi_m=0.92 * PSI, l_q=1.25 * L_Q, offset=0.06)


@pytest.fixture(scope="module")
def several():
    return diagnose_slow([log(SEVERAL)], NOMINAL)


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
        diagnose_slow([recording], NOMINAL)
    assert "\n" not in str(refused.value)


def test_few_operating_points_name_few_effects():
    answer = diagnose_slow([log(Truth(psi_m=0.95 * PSI), levels=LEVELS[:3])], NOMINAL)
    assert [e.name for e in answer.effects] == ["magnet_flux"] and not answer.ambiguity
    assert any("With 3 operating points at most 1" in note for note in answer.notes)
    several = diagnose_slow([log(SEVERAL, levels=LEVELS[:3])], NOMINAL)
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
    answer = diagnose_slow([log(seed=seed)], NOMINAL)
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
    model = model_effects(several.search, several.found)
    found = {k: e for effect in model for k, e in effect.parameters.items()}
    for name, truth in (("v_dead_v", 7.0), ("magnet_flux_wb", 0.92 * PSI), ("offset_rad", 0.06)):
        assert abs(found[name].value - truth) < max(4.0 * found[name].sigma, 0.02 * truth), name


def test_held_out_points_are_predicted(several):
    held = axis_misfit(several.search, several.found.best, several.held)
    for axis in "dq":
        assert held[axis]["after"] < 0.1 * held[axis]["before"]
        assert held[axis]["after"] < 3.0 * several.fit.noise_floor


def test_absent_effects_are_bounded(several):
    ruled_out = bounds(several.search, several.found)
    value, sigma, unit = ruled_out["resistance"]["parameters"]["resistance_ohm"]
    assert unit == "ohm" and abs(value - NOMINAL.machine.resistance_ohm) < 4.0 * sigma
    assert all(entry.get("score", 1.0) > -20.0 for entry in ruled_out.values())
    assert any("harmonics" in note for note in several.notes)


def test_flux_map_of_the_model_is_the_logs(several):
    chart = flux_map_of(several.search, several.found.best)
    n = len(chart.i_q_a) // 2
    assert chart.psi_d_wb[len(chart.i_d_a) // 2, n] == pytest.approx(0.92 * PSI, rel=0.01)
    slope = (chart.psi_q_wb[len(chart.i_d_a) // 2, 0] - 0.0) / chart.i_q_a[0]
    assert slope == pytest.approx(1.25 * L_Q, rel=0.03)
    assert chart.folds() == 0


def test_absurd_sizes_are_implausible():
    view = slow_view(log(Truth(l_q=6.0 * L_Q)), NOMINAL)
    search = SlowSearch(view, np.ones(len(view), bool))
    alone = next(m for m in search.every_set() if m.names == {"inductance_q"})
    assert not np.isfinite(search.refine(alone).score)


@pytest.mark.parametrize("share, costs", [(0.95, False), (0.5, True)])
def test_an_implausible_value_costs(share, costs):
    """Else a sum of absurd effects that cancel is preferred to the true ones."""
    view = slow_view(log(Truth(psi_m=share * PSI), levels=LEVELS[:8]), NOMINAL)
    search, model = SlowSearch(view, np.ones(len(view), bool)), Model(frozenset(["magnet_flux"]))
    prior = search.refine(model).score - search.linear.score(model, search.problem.dispersion)
    assert (prior > IMPLAUSIBLE) == costs and prior > 0.0


SETS = {  # the best set and those that tie with it: what is named, what is ambiguous, what is weak
    "AB": ("AB", [], []),
    "AB A": ("A", [], ["B"]),
    "AB A B": ("", ["AB"], []),
    "AB AC": ("A", ["BC"], []),
    "ABC AC BC": ("C", ["AB"], []),
    "ABC AB AD": ("A", ["BD"], ["C"]),
    "AB A BC": ("", ["ABC"], []),
    "AB AC DB DC": ("", ["BC", "AD"], []),
}


@pytest.mark.parametrize("sets", SETS)
def test_effects_that_replace_each_other_are_an_ambiguity(sets):
    best, *tied = [SimpleNamespace(model=Model(frozenset(s)), score=k) for k, s in enumerate(sets.split())]
    asserted, groups, weak = SETS[sets]
    found = sorted_out(SimpleNamespace(best=best, tied=tied))
    assert found == (list(asserted), [list(g) for g in groups], weak)
