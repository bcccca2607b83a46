# SPDX-License-Identifier: BSD-3-Clause
"""Limits of single effects: signs, sizes and forms that are physically possible, and what they are relative to."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import GRID, MACHINE, columns, recorded
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.answer.names import MEDIAN, _seen_discrepancy, credibilities, names_of
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.misfit import bulge, misfit
from fluxproof.diagnosis.balance.operating_points import point_numbers
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.catalogue.current_gain import PATTERNS
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns

NOMINAL = load_nominal(PAPER)
IDLE = ((160.0, 0.0, 0.0),) * 20


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def test_the_mean_current_of_a_period_is_that_of_the_stator_frame(view):
    """The flux is linear in time while the rotor turns; here the current is integrated numerically."""
    m, omega, i = MACHINE, 900.0, -2.0 + 4.0j
    period = NOMINAL.sample_time_s
    theta = np.array([[-0.5, 0.5]]) * omega * period
    psi = m.inductance_d_h * i.real + m.magnet_flux_wb + 1j * m.inductance_q_h * i.imag
    begin, end = psi * np.exp(1j * theta[0])
    share = (np.arange(20000) + 0.5) / 20000
    turn = np.exp(1j * (theta[0, 0] + share * omega * period))
    linked = (begin + share * (end - begin)) / turn
    mean = np.mean(turn * ((linked.real - m.magnet_flux_wb) / m.inductance_d_h + 1j * linked.imag / m.inductance_q_h))
    made = view.replace(theta=theta, i=np.full((1, 2), i), omega=np.full((1, 2), omega))
    plain = i - bulge(made)[0, 0]
    assert abs(made.i_mid[0, 0] - bulge(made)[0, 0] - mean) < 0.02 * abs(plain - mean)


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


def test_short_further_recording_has_no_drift(view):
    short = view.take(view.run == 2).replace(span_s=0.1 * view.span_s)
    course = joined_views([view, short, short]).course
    assert np.all(course[len(view) :] == 1.0) and course[len(view) - 1] == pytest.approx(view.course[-1])
    as_long = joined_views([view, view]).course
    assert as_long[len(view) - 1] == pytest.approx(0.5 * view.course[-1]) and as_long[-1] > 0.9


def points_view(*points):
    """A stub view for counting points, with blocks at (speed, i_q) in per unit."""
    omega, i_q = 500.0 * np.array(points)[:, :1], NOMINAL.machine.rated_current_a * np.array(points)[:, 1:]
    return SimpleNamespace(machine=NOMINAL.machine, omega=np.repeat(omega, 3, axis=1), i=np.repeat(1j * i_q, 3, axis=1))


def test_operating_point_is_not_split():
    """Blocks scatter around their point; fixed bins would split some points."""
    for i_q in np.linspace(0.1, 0.9, 81):
        scattered = [(1.0, i_q + 0.004 * (-1) ** n) for n in range(6)]
        assert point_numbers(points_view(*scattered), 0.08).tolist() == [0] * 6
    apart = points_view((1.0, 0.2), (1.0, 0.6), (1.0, 0.21), (-1.0, 0.2))
    assert point_numbers(apart, 0.08).tolist() == [0, 1, 0, 2]


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
        assert {key.split("_")[0] for key in CATALOGUE["cogging"].core(cogging)} == {f"n{n}", f"n{2 * n}"}


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
    assert not possible(flux(-3e-3, -3e-4), sure, NOMINAL)
    assert possible(flux(-3e-3, -3e-4), np.diag([1e-10, 1e-6]), NOMINAL)


def test_flux_lost_from_the_start_is_no_drift():
    """A demagnetised rotor that recovers slightly: a free drift could imitate it by a step at the start."""
    possible, course = CATALOGUE["magnet_temperature"].possible, np.array([0.0, 0.08, 0.25, 0.55, 1.0])

    def drift(change):
        """Coefficients of a change of flux at the knots of the course [Wb]."""
        bends = (change - change[-1] * course)[1:4]
        return {"drift": change[-1], **{f"course_{k}": bend for k, bend in enumerate(bends)}}

    recovering = -1e-3 * np.array([0.0, 0.99, 0.96, 0.92, 0.85])
    warming = -1e-3 * (1.0 - np.exp(-5.0 * course))
    assert not possible(drift(recovering), np.zeros((4, 4)), NOMINAL)
    assert possible(drift(warming), np.zeros((4, 4)), NOMINAL)
    assert possible({"drift": -1e-3}, np.zeros((1, 1)), NOMINAL)


def test_missing_flux_at_zero_current_is_found_or_open():
    """Without current a dead time may resemble it."""
    answer = diagnose(recorded(IDLE, machine={"magnet_flux_wb": 0.995 * MACHINE.magnet_flux_wb}), NOMINAL)
    assert {e.name for e in answer.effects} <= {"magnet_flux"}
    assert answer.effects or any("magnet_flux" in group for group in answer.ambiguity)


def test_the_resistance_of_a_metal_rises_with_its_temperature(view):
    """Magnets that warm at i_d = 0 look like a winding of -1.2 %/K."""
    possible, sure = CATALOGUE["resistance_temperature"].possible, 1e-12 * np.eye(2)
    assert not possible({"alpha": -0.012, "ahead": 0.0}, sure, view.nominal)
    assert possible({"alpha": 0.004, "ahead": 0.0}, sure, view.nominal)
    assert possible({"alpha": -0.001, "ahead": 0.0}, 1e-6 * np.eye(2), view.nominal)  # within its uncertainty
    assert possible({"drift": -0.1}, sure[:1, :1], view.nominal)  # without a temperature it may cool down


def test_half_of_the_points_show_what_is_left_beside_a_load():
    """A friction of 0.8 N m on a free shaft, with 0.03 N m left, was no more credible than beside 0.25 N m."""
    left = np.array([0.03, -0.02, 0.05, -0.03, 5.0])  # the last one is loaded
    points = SimpleNamespace(
        y=left, x=np.zeros((5, 1)), level=np.full(5, 0.085), group=np.zeros(5, int), loads=0, groups=[0]
    )
    fit = SimpleNamespace(
        problem=SimpleNamespace(p=points), lam=np.array([3.0]), take=np.zeros(1, int), vector=np.zeros(1)
    )
    assert _seen_discrepancy(fit)[0] == pytest.approx(0.03 / 0.085 / MEDIAN)
    points.y = np.full(5, 5.0)
    assert _seen_discrepancy(fit)[0] == 3.0


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


def test_what_is_clearly_seen_is_named_though_it_is_small():
    """Offsets of 0.8 times the smallest of interest were impossible: "unknown, mostly in the sum of the currents"."""
    c = dict(columns(GRID))
    c["i_a"] = c["i_a"] + 0.8 * CATALOGUE["current_offset"].floor(NOMINAL)
    answer = diagnose(from_columns(c, NOMINAL.sample_time_s), NOMINAL)
    assert [e.name for e in answer.effects] == ["current_offset"] and answer.verdict == "explained"


def two_effects(share_along):
    """A fit of a sure effect of the size 10 and one of the size 2, beside a leftover of the size 1.

    share_along: of what the small one explains that lies along the large one's column.
    """
    x = np.stack([np.tile([1.0, 1.0], 50), np.tile([1.0, -1.0], 50)], axis=1)
    x[:, 1] = np.sqrt(share_along) * x[:, 0] + np.sqrt(1.0 - share_along) * x[:, 1]
    points = SimpleNamespace(
        y=np.zeros(100), x=x, level=np.full(100, 0.1), doubt=np.zeros(100), group=np.zeros(100, int), loads=-1,
        groups=[("u", 6.0, False)],
    )  # fmt: skip
    problem = SimpleNamespace(p=points, keys=[("large", "a"), ("small", "a")], setup=SimpleNamespace(load=0.0))
    return SimpleNamespace(
        problem=problem, names=("large", "small"), lam=np.array([10.0]), mu=np.zeros(1), take=np.arange(2),
        vector=np.array([10.0, 2.0]), variance=np.ones(100),
    )  # fmt: skip


@pytest.mark.parametrize("load, credible", [(1.0, True), (0.0, False)])
def test_a_torque_that_nobody_measured_does_not_withhold_what_the_voltage_shows(load, credible):
    """Offsets of the sensors, all that the voltage showed, were possible (0.21) beside an unknown load of the shaft.

    A torque of a transducer counts.
    """
    seen, torque = np.repeat([True, False], 50), np.repeat([False, True], 50)
    points = SimpleNamespace(
        y=np.zeros(100), x=(np.where(seen, 1.0, 3.0))[:, None], level=np.full(100, 0.1), doubt=np.zeros(100),
        group=torque.astype(int), loads=-1, groups=[("u", 1.0, False), ("torque", 1.0, False)],
    )  # fmt: skip
    problem = SimpleNamespace(
        p=points, keys=[("offset", "a")], setup=SimpleNamespace(load=load),
        cells=SimpleNamespace(electrical=frozenset({"offset"})),
    )  # fmt: skip
    fit = SimpleNamespace(
        problem=problem, names=("offset",), lam=np.array([1.0, 30.0]), mu=np.zeros(2), take=np.arange(1),
        vector=np.ones(1), variance=np.ones(100),
    )  # fmt: skip
    assert (credibilities(fit)["offset"] > 0.95) is credible


def test_an_error_of_a_sure_effect_imitates_what_is_like_it():
    """EMF harmonics beside a dead time were withheld for its error; a resistance beside it may well be that error."""
    apart, alike = (credibilities(two_effects(share)) for share in (0.05, 0.99))
    assert apart["large"] > 0.999 and alike["large"] > 0.999
    assert apart["small"] > 0.95 > alike["small"]


def test_an_effect_is_as_credible_as_in_the_mean_of_its_sets():
    """An iron loss of 1750 +- 860 ohm was named, as one of its sets left less beside it than the best one."""
    sets = [(0.6, two_effects(0.99)), (0.4, two_effects(0.05))]
    posterior = SimpleNamespace(
        weights=lambda: sets, best=lambda: sets[0][1], present=lambda: {"large": 1.0, "small": 1.0},
        setup=SimpleNamespace(effects={name: SimpleNamespace(named=True) for name in ("large", "small")}),
    )  # fmt: skip
    names = names_of(posterior)
    assert names.said == {"large"}
    expected = sum(p * credibilities(fit)["small"] for p, fit in sets)
    assert names.maybe["small"] == pytest.approx(expected)


WARMED = [((20, 60), 0.0, True), ((20, 60), 0.0039, False), ((20, 23), 0.0, False)]


@pytest.mark.parametrize("temp, coefficient, expected", WARMED)
def test_a_warm_winding_is_expected_to_have_another_resistance(temp, coefficient, expected):
    """Of a heat run, the magnets' drift alone took the winding's share: it was 40 % too small, and sure."""
    machine = SimpleNamespace(resistance_ohm=1.0, resistance_temp_coeff_per_k=coefficient)
    view = SimpleNamespace(temp=np.array(temp, float), machine=machine, nominal=SimpleNamespace(machine=machine))
    assert CATALOGUE["resistance_temperature"].expected(view) is expected
    assert not CATALOGUE["magnet_temperature"].expected(view)
