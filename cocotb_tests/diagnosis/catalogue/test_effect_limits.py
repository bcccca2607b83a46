# SPDX-License-Identifier: BSD-3-Clause
"""Limits of single effects: signs, sizes and forms that are physically possible, and what they are relative to."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import GRID, MACHINE, columns, recorded
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.curves import COURSE_KNOTS
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.catalogue.current_gain import PATTERNS
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns

NOMINAL = load_nominal(PAPER)
IDLE = ((160.0, 0.0, 0.0),) * 20


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def test_an_angle_may_be_late_by_rows_and_currents_not(view):
    """It was told as a delay of the voltage, and a winding of which the resistance rises by two thirds."""
    too_large, row, most = CATALOGUE["sampling_skew"].too_large, view.sample_time_s, 0.5 / view.top_speed
    assert not too_large({"tau": 0.0, "angle": -0.9 * most}, view) and too_large({"angle": -1.1 * most}, view)
    assert too_large({"tau": 0.5 * row, "angle": 0.0}, view) and not too_large({"tau": 0.2 * row}, view)


@pytest.mark.slow
def test_an_angle_that_is_a_row_late_is_the_sampling_instant():
    table = dict(columns(GRID))
    table["theta_e"] = np.concatenate([table["theta_e"][:1], table["theta_e"][:-1]])
    answer = diagnose(from_columns(table, NOMINAL.sample_time_s), NOMINAL)
    assert {e.name for e in answer.effects} == {"sampling_skew"}, answer.sentence
    assert answer.effects[0].parameters["skew_s"].value == pytest.approx(NOMINAL.sample_time_s, rel=0.02)


def test_resistance_does_not_fall_with_speed():
    possible, sure = CATALOGUE["resistance"].possible, np.diag([1e-6, 1e-6])
    assert possible({"delta_r": -0.2}, sure[:1, :1], NOMINAL) and possible({"delta_r": 0.1, "skin": 0.1}, sure, NOMINAL)
    assert not possible({"delta_r": 0.1, "skin": -0.1}, sure, NOMINAL)
    assert possible({"delta_r": 0.1, "skin": -0.1}, np.diag([1e-6, 0.01]), NOMINAL)


def test_encoder_error_at_the_electrical_order_is_no_current_offset():
    table = dict(columns(GRID))
    theta = np.unwrap(table["theta_e"])
    table["theta_e"] = theta + 0.03 * np.cos(theta / MACHINE.pole_pairs) + 0.002 * np.cos(theta + 0.4)
    answer = diagnose(from_columns(table, NOMINAL.sample_time_s), PAPER)
    assert [e.name for e in answer.effects] == ["encoder_eccentricity"], answer.sentence
    assert answer.effects[0].parameters["amplitude_rad"].value == pytest.approx(0.03, rel=0.02)


def test_effects_below_their_floor_stay_unnamed():
    answer = diagnose(recorded(machine={"resistance_ohm": 1.007 * MACHINE.resistance_ohm}), NOMINAL)
    assert answer.verdict == "no_mismatch" and not answer.effects


def test_hysteresis_draws_nothing_from_the_noise_of_a_standstill(view):
    noise = np.random.default_rng(6).standard_normal(view.omega.shape)
    still = view.replace(omega=0.3 * (noise - noise.mean(axis=1, keepdims=True)), memo={"top_speed": 500.0})
    column = CATALOGUE["iron_loss"].core(still)["g_hysteresis"]["u"]
    assert np.abs(column).max() < 1e-9 * np.abs(CATALOGUE["iron_loss"].core(view)["g_hysteresis"]["u"]).max()


def test_equal_gains_do_not_rotate_the_vector():
    possible, sure = CATALOGUE["current_gain"].possible, 1e-12 * np.eye(4)
    of = lambda turn, alpha: {"alpha": alpha, "beta": 0.0, "common": 0.02, "turn": turn}  # noqa: E731
    assert not possible(of(0.04, 1e-5), sure, NOMINAL) and possible(of(0.04, 1e-5), 1e-3 * np.eye(4), NOMINAL)
    assert possible(of(0.02 / 6, 0.02), sure, NOMINAL) and possible({"alpha": 0.02, "beta": 0.0}, sure[:2, :2], NOMINAL)


def test_rotation_by_two_sensors_is_within_the_limit(view):
    """The largest rotation by two gains and i_c = -i_a - i_b, relative to the size of the unequal gains."""
    i_abc, effect = view.phases(view.i), CATALOGUE["current_gain"]
    error = i_abc * np.array([0.02, -0.02, 0.0])
    error[..., 2] = -error[..., 0] - error[..., 1]
    turns = [*gain_waves(view), view.i, 1j * view.i]
    stack = np.array([np.concatenate([w.real.ravel(), w.imag.ravel()]) for w in turns]).T
    wanted = view.from_phases(error)
    c = np.linalg.lstsq(stack, np.concatenate([wanted.real.ravel(), wanted.imag.ravel()]), rcond=None)[0]
    c = dict(zip(("alpha", "beta", "common", "turn"), map(float, c), strict=True))
    assert abs(c["turn"]) == pytest.approx(effect.size(c, NOMINAL) / 6, rel=0.01)
    assert effect.possible(c, 1e-16 * np.eye(4), NOMINAL)


def gain_waves(view):
    """Current errors of a unit of the two patterns of gains."""
    return [view.from_phases(view.phases(view.i) * np.array(w)) for w in PATTERNS.values()]


def test_hysteresis_draws_its_current_at_a_low_speed_too(view):
    """Half the rated current is the bound at the recorded speeds: a tenth of the speed, ten times the conductance."""
    slow = view.replace(omega=0.1 * view.omega, memo={})
    g = 0.3 * view.machine.rated_current_a / (slow.top_speed * MACHINE.magnet_flux_wb)
    assert not CATALOGUE["iron_loss"].too_large({"g_fe": g}, slow)
    assert CATALOGUE["iron_loss"].too_large({"g_fe": g}, view.replace(memo={}))
    bus = CATALOGUE["udc_gain"].too_large
    assert bus({"gain": 2.6}, view) and bus({"gain": -0.8}, view) and not bus({"gain": 2.0}, view)


def test_friction_cannot_drive_the_shaft():
    possible, sure = CATALOGUE["friction"].possible, np.diag([1e-12, 1e-12])
    viscous = NOMINAL.machine.viscous_friction_nms
    assert possible({"viscous": -0.9 * viscous, "coulomb": 0.0}, sure, NOMINAL)
    assert not possible({"viscous": -1.5 * viscous, "coulomb": 0.0}, sure, NOMINAL)
    assert possible({"viscous": -1.5 * viscous, "coulomb": 0.0}, np.diag([viscous**2, 0.0]), NOMINAL)
    # Nor does it at a low speed only.
    coulomb = NOMINAL.machine.coulomb_friction_nm or 0.0
    assert possible({"viscous": viscous, "coulomb": 0.1 - coulomb}, sure, NOMINAL)
    assert not possible({"viscous": viscous, "coulomb": -0.1 - coulomb}, sure, NOMINAL)


def test_cogging_order_is_not_its_harmonic(view):
    """More of the slow blocks resolve order 8 than order 4, so that it locks better; it is still the harmonic."""
    quiet = view.replace(torque=np.zeros(view.u_dc.shape), shaft=np.full(len(view), "torque"), memo={})
    nominal = -misfit(quiet)["torque"]
    for first, second, order in ((1.0, 0.4, 4), (0.0, 1.0, 8)):
        waves = first * np.sin(4 * view.theta_mid + 0.3) + second * np.sin(8 * view.theta_mid + 1.0)
        cogging = quiet.replace(torque=nominal + waves, memo={})
        n = order * view.machine.pole_pairs
        assert {wave.order for wave in CATALOGUE["cogging"].core(cogging)} == {n, 2 * n}


def test_an_axis_without_current_has_no_curve(view):
    still = view.replace(i=1j * view.i.imag + 0.01 * view.machine.rated_current_a, memo={})
    assert set(CATALOGUE["inductance_d"].free(view)) == {"bend_2", "bend_3"}
    assert CATALOGUE["inductance_d"].free(still) == {} and CATALOGUE["inductance_q"].free(still)
    later = view.replace(memo=still.memo)  # decided once for all views of a recording
    assert CATALOGUE["inductance_d"].free(later) == {}


def test_lost_flux_does_not_fall_further():
    possible, sure = CATALOGUE["magnet_flux"].possible, np.diag([1e-10, 1e-10])
    flux = lambda lost, recovery: {"delta_psi_m": lost, "recovery": recovery}  # noqa: E731
    assert possible(flux(-3e-3, 3e-4), sure, NOMINAL) and possible({"delta_psi_m": -3e-3}, sure[:1, :1], NOMINAL)
    assert not possible(flux(-9e-3, -9e-4), sure, NOMINAL)
    assert possible(flux(-9e-3, -9e-4), np.diag([1e-10, 1e-6]), NOMINAL)
    assert possible(flux(-9e-3, -3e-4), sure, NOMINAL)  # 0.2 %, less than anyone asks for


def test_flux_lost_from_the_start_is_no_drift():
    """A demagnetised rotor that recovers slightly: a free drift could imitate it by a step at the start."""
    possible, course = CATALOGUE["magnet_temperature"].possible, COURSE_KNOTS

    def drift(change):
        """Coefficients of a change of flux at the knots of the course [Wb]."""
        bends = (change - change[-1] * course)[1:-1]
        return {"drift": change[-1], **{f"course_{k}": bend for k, bend in enumerate(bends)}}

    recovering = -1e-3 * np.interp(course, (0.0, 0.08, 0.25, 0.55, 1.0), (0.0, 0.99, 0.96, 0.92, 0.85))
    warming = -1e-3 * (1.0 - np.exp(-5.0 * course))
    sure = np.zeros((len(course) - 1,) * 2)
    assert not possible(drift(recovering), sure, NOMINAL)
    assert possible(drift(warming), sure, NOMINAL)
    assert possible({"drift": -1e-3}, np.zeros((1, 1)), NOMINAL)


def test_missing_flux_at_zero_current_is_found_or_open():
    """Without current a dead time may resemble it."""
    answer = diagnose(recorded(IDLE, machine={"magnet_flux_wb": 0.99 * MACHINE.magnet_flux_wb}), NOMINAL)
    assert {e.name for e in answer.effects} <= {"magnet_flux"}
    assert answer.effects or any("magnet_flux" in group for group in answer.ambiguity)


def test_the_resistance_of_a_metal_rises_with_its_temperature(view):
    """Magnets that warm at i_d = 0 look like a winding of -1.2 %/K."""
    possible, sure = CATALOGUE["resistance_temperature"].possible, 1e-12 * np.eye(2)
    assert not possible({"alpha": -0.012, "ahead": 0.0}, sure, view.nominal)
    assert possible({"alpha": 0.004, "ahead": 0.0}, sure, view.nominal)
    assert possible({"alpha": -0.001, "ahead": 0.0}, 1e-6 * np.eye(2), view.nominal)  # within its uncertainty
    assert possible({"drift": -0.1}, sure[:1, :1], view.nominal)  # without a temperature it may cool down


@pytest.mark.parametrize("written", [False, True])
def test_the_gain_of_one_of_two_sensors_is_that_of_one(written):
    """The third current is computed, so that it has the error of the others; three gains were 4.5, -1.5, 1.5 %.

    Of a text file the three are rounded each, so that their sum is not exactly zero: the answer was "unknown".
    """
    c = dict(columns(GRID))
    c["i_a"] = 1.03 * c["i_a"]
    c["i_c"] = -c["i_a"] - c["i_b"]
    if written:
        c |= {name: np.round(c[name], 3) for name in ("i_a", "i_b", "i_c")}
        assert np.any(sum(c[name] for name in ("i_a", "i_b", "i_c")))
    else:
        del c["i_c"]
    (found,) = diagnose(from_columns(c, NOMINAL.sample_time_s), NOMINAL).effects
    assert found.name == "current_gain" and set(found.parameters) == {"gain_a", "gain_b"}
    assert found.parameters["gain_a"].value == pytest.approx(0.03, abs=1e-3)
    assert abs(found.parameters["gain_b"].value) < 1e-3
    assert found.plant["sensors.current_gain_error"] == pytest.approx([0.03, 0.0, 0.0], abs=1e-3)


def test_opposite_gains_of_two_of_three_sensors_are_told_in_full():
    """They were told as those of two sensors whose third current is computed, which are half as large."""
    c = dict(columns(GRID))
    gains = {"a": -0.06, "b": 0.056, "c": 0.004}
    for phase, gain in gains.items():
        c[f"i_{phase}"] = (1.0 + gain) * c[f"i_{phase}"]
    (found,) = diagnose(from_columns(c, NOMINAL.sample_time_s), NOMINAL).effects
    assert found.name == "current_gain"
    assert {x: found.parameters[f"gain_{x}"].value for x in "abc"} == pytest.approx(gains, abs=2e-3)


def test_offsets_of_dq_currents_are_told_as_differences():
    """An equal offset of all three phases does not show in dq: a single sensor that is off looks like three."""
    effect = CATALOGUE["current_offset"]
    assert "sum of zero" in effect.caveat(SimpleNamespace(has_sum=False), {})
    assert not effect.caveat(SimpleNamespace(has_sum=True), {})


def test_what_is_clearly_seen_is_told_though_it_is_too_small_to_act_on():
    """Offsets of 0.8 times the smallest of interest were impossible: "unknown, mostly in the sum of the currents"."""
    c = dict(columns(GRID))
    c["i_a"] = c["i_a"] + 0.8 * CATALOGUE["current_offset"].floor(NOMINAL)
    answer = diagnose(from_columns(c, NOMINAL.sample_time_s), NOMINAL)
    assert [e.name for e in answer.minor] == ["current_offset"] and answer.verdict == "no_mismatch"
    assert any("offsets of the current sensors" in note.lower() and "too small" in note for note in answer.notes)


WARMED = [((20, 60), 0.0, True), ((20, 60), 0.0039, False), ((20, 23), 0.0, False)]


@pytest.mark.parametrize("temp, coefficient, expected", WARMED)
def test_a_warm_winding_is_expected_to_have_another_resistance(temp, coefficient, expected):
    """Of a heat run, the magnets' drift alone took the winding's share: it was 40 % too small, and sure."""
    machine = SimpleNamespace(resistance_ohm=1.0, resistance_temp_coeff_per_k=coefficient)
    view = SimpleNamespace(temp=np.array(temp, float), machine=machine, nominal=SimpleNamespace(machine=machine))
    assert CATALOGUE["resistance_temperature"].expected(view) is expected
    assert not CATALOGUE["magnet_temperature"].expected(view)
