"""Ties: equivalent explanations, combinations that are no explanation, and effects that must not absorb others."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import GRID, MACHINE, columns, recorded
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance import bulge
from fluxproof.diagnosis.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.catalogue.current_gain import PATTERNS
from fluxproof.diagnosis.catalogue.sampling_skew import unskewed
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.recording import from_columns
from fluxproof.diagnosis.refine import operating_points, point_numbers
from fluxproof.diagnosis.search import Search
from fluxproof.diagnosis.verdict import groups, lag_of_currents
from fluxproof.diagnosis.view import joined_views

NOMINAL = load_nominal(PAPER)


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


@pytest.fixture(scope="module")
def search(view):
    return Search(view, CATALOGUE, np.ones(len(view), bool))


def solved(*names, chi2=100.0, score=120.0, **c) -> Solution:
    return Solution(Model(frozenset(names)), chi2, 1, 1000, c=c, score=score)


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


def test_late_voltage_and_early_angle_are_a_current_filter():
    lag = lambda delay, **c: lag_of_currents(solved("delay", "sampling_skew", delay={"tau": delay}, sampling_skew=c))  # noqa: E731
    assert lag(1e-5, tau=-1.03e-5) == lag(1e-5, tau=0.0, angle=0.97e-5) == 1e-5
    assert lag(1e-5, tau=-2e-6) == lag(1e-5, tau=1e-5) == lag(-1e-5, tau=1e-5) == 0.0
    assert lag_of_currents(solved("delay", delay={"tau": 1e-5})) == 0.0


def test_equally_late_currents_and_angle_are_no_skew():
    """Gates shifted relative to the converters are a delay; a skew absorbs the effect on the ripple."""
    shadow = lambda **c: CATALOGUE["sampling_skew"].overshadowed({"sampling_skew": c}, NOMINAL)  # noqa: E731
    assert shadow(tau=1.02e-5, angle=1.05e-5) == np.inf
    assert shadow(tau=1e-6) == shadow(tau=1e-6, angle=0.0) == shadow(tau=6e-8, angle=2.57e-6) == 0.0


def test_equal_errors_of_bus_and_sensors_are_no_explanation():
    of = lambda bus, common: solved("udc_gain", "current_gain", udc_gain={"gain": bus}, current_gain={"common": common})  # noqa: E731
    assert Search.scaled_alike(of(-0.12, -0.121)) and not Search.scaled_alike(of(-0.12, 0.01))
    assert not Search.scaled_alike(solved("udc_gain", udc_gain={"gain": -0.12}))


def test_exchange_frees_the_absorbing_effect(search):
    both = Model(frozenset(["magnet_flux", "magnet_temperature"]))
    assert not search.allowed(both) and search.allowed(search.admitted(both))
    assert search.admitted(both).free == {"magnet_temperature"}
    alone = Model(frozenset(["resistance"]))
    assert search.admitted(alone) == alone


def test_chi2_difference_is_scaled_by_the_actual_errors(view, search):
    """A chi^2 difference of 5 is a tie if rows scatter as assumed, but not with a third of that scatter."""
    use = search.cells.ok & search.train
    draw = np.random.default_rng(4).standard_normal((2, len(use)))
    apart = np.where(use, draw[0], 0.0)  # where the other one differs
    apart *= np.sqrt(5.0 / (apart @ apart))

    def compared(scatter):
        left = scatter * draw[1]
        left -= apart * (left @ apart) / 5.0  # so that chi^2 differs by that of the difference
        best, other = solved("delay"), solved("sampling_skew", chi2=105.0, score=125.0)
        for s, residual in ((best, left), (other, left + apart)):
            s.residual, s.view = residual * search.sigma, view
        assert np.sum(((left + apart) ** 2 - left**2)[use]) == pytest.approx(5.0)
        return search.as_good(best, other, 10.0)

    assert compared(1.0) and not compared(0.33)


def test_one_operating_point_does_not_determine_the_errors(view):
    one = view.take(view.run == 3)
    lone = Search(one, {n: CATALOGUE[n] for n in ("resistance", "magnet_flux")}, np.ones(len(one), bool))
    use = lone.cells.ok
    best, other = solved("resistance"), solved("magnet_flux", chi2=105.0, score=125.0)
    best.residual, other.residual = np.zeros(len(use)), 0.1 * lone.sigma
    best.view = other.view = one
    assert lone.as_good(best, other, 10.0)


def test_pruned_model_is_replaced_by_a_better_one_of_its_size():
    search = object.__new__(Search)
    search._simplified = lambda s: s
    large, remains = solved("delay", "iron_loss", score=50.0), solved("delay", score=400.0)
    better, curved = solved("sampling_skew", score=90.0), solved("saturation", score=60.0)
    search.refined = {s.model: s for s in (large, remains, better, curved)}
    search._earning = lambda s: remains if s is large else s
    assert search._pruned(large) is better  # not the curve, which is named by its shape
    search._earning = lambda s: remains
    assert search._pruned(large) is remains  # the better one's effect is insignificant
    nothing = solved(score=500.0)
    search._earning = lambda s: nothing if s is large else s
    assert search._pruned(large) is better  # although an empty model has no other of its size


def test_pruning_keeps_simplified_scales():
    """Equal bus and sensor errors are a magnet flux error, and must not return after pruning."""
    search = object.__new__(Search)
    magnets, remains = solved("magnet_flux", "current_gain", score=90.0), solved("magnet_flux", "delay", score=400.0)
    alike = solved("udc_gain", "current_gain", score=50.0)
    search.refined = {s.model: s for s in (remains, alike)}
    search._earning = lambda s: remains if s is magnets else s
    search._simplified = lambda s: magnets if s is alike else s
    assert search._pruned(magnets) is remains
    search._simplified = lambda s: s
    assert search._pruned(magnets) is alike


def test_effects_below_their_floor_stay_unnamed():
    answer = diagnose(recorded(machine={"resistance_ohm": 1.007 * MACHINE.resistance_ohm}), NOMINAL)
    assert answer.verdict == "no_mismatch" and not answer.effects


def test_short_further_recording_has_no_drift(view):
    short = view.take(view.run == 2).replace(span_s=0.1 * view.span_s)
    course = joined_views([view, short, short]).course
    assert np.all(course[len(view) :] == 1.0) and course[len(view) - 1] == pytest.approx(view.course[-1])
    as_long = joined_views([view, view]).course
    assert as_long[len(view) - 1] == pytest.approx(0.5 * view.course[-1]) and as_long[-1] > 0.9


def test_small_is_below_the_floor(search):
    r = NOMINAL.machine.resistance_ohm
    of = lambda share: SimpleNamespace(c={"resistance": {"delta_r": share * r}})  # noqa: E731
    assert search.small(of(0.009), "resistance") and not search.small(of(0.011), "resistance")


def points_view(*points):
    """A stub view for counting points, with blocks at (speed, i_q) in per unit."""
    omega, i_q = 500.0 * np.array(points)[:, :1], NOMINAL.machine.rated_current_a * np.array(points)[:, 1:]
    return SimpleNamespace(machine=NOMINAL.machine, omega=np.repeat(omega, 3, axis=1), i=np.repeat(1j * i_q, 3, axis=1))


def test_operating_point_is_not_split():
    """Blocks scatter around their point; fixed bins would split some points."""
    for i_q in np.linspace(0.1, 0.9, 81):
        scattered = [(1.0, i_q + 0.004 * (-1) ** n) for n in range(6)]
        assert operating_points(points_view(*scattered)) == 1
    assert point_numbers(points_view((1.0, 0.2), (1.0, 0.6), (1.0, 0.21), (-1.0, 0.2))).tolist() == [0, 1, 0, 2]


def test_number_of_effects_is_limited_by_the_points(view):
    """Four points give eight means: three effects with their curves would fit anything."""
    point = point_numbers(view)
    chosen = np.roll(np.unique(point), -point[np.argmax(np.abs(view.omega).max(axis=1))])  # the fastest one first
    firsts = [view.take(np.isin(point, chosen[:n])) for n in (1, 2, 3, 4, 7)]
    assert [operating_points(v) for v in firsts] == [1, 2, 3, 4, 7]
    most = [Search(v, {"delay": CATALOGUE["delay"]}, np.ones(len(v), bool)).most for v in firsts]
    assert most == [1, 1, 2, 2, 4]


def test_hysteresis_draws_nothing_from_the_noise_of_a_standstill(view):
    noise = np.random.default_rng(6).standard_normal(view.omega.shape)
    still = view.replace(omega=0.3 * (noise - noise.mean(axis=1, keepdims=True)), memo={"top_speed": 500.0})
    column = CATALOGUE["iron_loss"].core(still)["g_hysteresis"]["u"]
    assert np.abs(column).max() < 1e-9 * np.abs(CATALOGUE["iron_loss"].core(view)["g_hysteresis"]["u"]).max()


def test_every_effect_is_refined_at_one_operating_point(view):
    """After correction a delay may score far better than its linear column, and be tied."""
    one = view.take(view.run == 3)
    lone = Search(one, CATALOGUE, np.ones(len(one), bool))
    able = {n for n in CATALOGUE if lone.linear.index[n][0]}
    assert lone.most == 1 and set().union(*(m.names for m in lone._linear_best())) == able


def test_small_effect_may_be_another_one_at_one_operating_point(view):
    lone = object.__new__(Search)
    lone.view, lone.effects, lone.dispersion = view, CATALOGUE, 1.0
    tiny, other = ({"delta_psi_m": 1e-4 * MACHINE.magnet_flux_wb}, {"delta_r": 0.2 * MACHINE.resistance_ohm})
    best, rival = solved("magnet_flux", magnet_flux=tiny), solved("resistance", score=125.0, resistance=other)
    lone.refined, lone.as_good = {s.model: s for s in (best, rival)}, lambda *args: True
    for most, tied in ((1, [rival]), (3, [])):
        lone.most = most
        assert lone._tied(best, True) == tied


def test_name_replaceable_by_an_unnamed_effect_is_uncertain(view):
    """A delay with an unnamed skew fits as well as the delay with a bus gain: the gain is uncertain."""
    few = object.__new__(Search)
    few.view, few.effects, few.most, few.as_good = view, CATALOGUE, 2, lambda *args: True
    late, gain = {"tau": 5e-5}, {"gain": 0.0033}
    best = solved("delay", "udc_gain", delay=late, udc_gain=gain)
    rival = solved("delay", "sampling_skew", score=125.0, delay=late, sampling_skew={"tau": 1e-8})
    nothing = solved("sampling_skew", score=125.0, sampling_skew={"tau": 1e-8})
    other = solved("delay", "iron_loss", "sampling_skew", score=125.0, delay=late, sampling_skew={"tau": 1e-8})
    other.c["iron_loss"] = {"g_fe": 0.1}
    few.refined = {s.model: s for s in (best, rival, nothing, other)}
    assert few._tied(best, True) == [rival]
    assert groups(best, [rival], CATALOGUE, NOMINAL, frozenset(["sampling_skew"])) == (["delay"], [])


def test_alternative_cause_is_no_superfluous_effect(view):
    """A bus gain for two wrong inductances is an alternative; one of them with another effect is not."""
    lone = object.__new__(Search)
    lone.view, lone.effects, lone.most, lone.as_good = view, CATALOGUE, 1, lambda *args: True
    m = MACHINE
    d, q = ({"delta_l_d": 0.1 * m.inductance_d_h}, {"delta_l_q": 0.1 * m.inductance_q_h})
    best = solved("inductance_d", "inductance_q", inductance_d=d, inductance_q=q)
    gain = solved("udc_gain", score=125.0, udc_gain={"gain": -0.03})
    beside = solved("inductance_d", "encoder_offset", score=125.0, inductance_d=d, encoder_offset={"offset": 0.03})
    lone.refined = {s.model: s for s in (best, gain, beside)}
    assert lone._tied(best, False) == [gain]


def shifted_gates(plan):
    """A view of a recording with gates late by 30 us, so that its currents are sampled 18 us off the valley."""
    view = view_of(recorded(plan), NOMINAL)
    return CATALOGUE["delay"].corrected(unskewed(view, -18e-6), {"tau": -30e-6})


def test_gates_that_are_late_sample_off_the_valley():
    """At one operating point this is a form of the delay; with more points it is a separate skew."""
    view = shifted_gates(((80.0, -2.0, 3.0),) * 20)
    search = Search(view, CATALOGUE, np.ones(len(view), bool))
    found = search.run()
    assert "delay" in set().union(*(s.model.names for s in (found.best, *found.tied)))
    assert set(CATALOGUE["delay"].free(search.view)) == {"off_valley"} and not CATALOGUE["delay"].free(view)
    c = search.refine(Model(frozenset(["delay"]), frozenset(["delay"]))).c["delay"]
    assert c["tau"] == pytest.approx(30e-6, rel=0.1) and c["off_valley"] == pytest.approx(18e-6, rel=0.1)
    possible, sure = CATALOGUE["delay"].possible, np.diag([1e-16, 1e-16])
    assert possible(c, sure, NOMINAL) and not possible({"tau": 1e-5, "off_valley": 2e-5}, sure, NOMINAL)


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
    assert bus({"gain": 0.6}, view) and not bus({"gain": 0.4}, view)


def test_a_constant_must_outlast_the_start_of_a_recording(view):
    """A lagging thermocouple causes a step before the first knot of a drift, which a constant would cancel."""
    names = frozenset(["magnet_flux", "magnet_temperature"])
    psi = MACHINE.magnet_flux_wb

    def named(constant, step):
        c = {"drift": -0.02 * psi, "course_0": step, "course_1": 0.7 * step, "course_2": 0.4 * step}
        best = Solution(Model(names, names), 1.0, 5, 100, view=view)
        best.c = {"magnet_flux": {"delta_psi_m": constant}, "magnet_temperature": c}
        return groups(best, [], CATALOGUE, NOMINAL, cold=True)

    assert named(0.006 * psi, -0.005 * psi) == (["magnet_temperature"], [])
    assert named(0.006 * psi, 0.0) == named(0.006 * psi, 0.005 * psi) == (sorted(names), [])
    assert named(-0.006 * psi, -0.005 * psi) == (sorted(names), [])
