"""Rules for similar effects: drift or constant, inductance or saturation, resistance or device drop."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import GRID, MACHINE, columns, recorded
from fluxproof.diagnosis.balance import misfit
from fluxproof.diagnosis.blocks import view_of, views_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.curvature import has_both, labels
from fluxproof.diagnosis.effect import rated_torque
from fluxproof.diagnosis.fit import Model
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.physics import held_out
from fluxproof.diagnosis.recording import from_columns
from fluxproof.diagnosis.refine import Refiner
from fluxproof.diagnosis.request import wants_cold
from fluxproof.diagnosis.verdict import beyond_doubt, carried, groups
from fluxproof.diagnosis.view import joined_views, started_cold

NOMINAL = load_nominal(PAPER)
COLD = NOMINAL.machine.temperature_ref_c


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def warm(view, temperature):
    return view.replace(temp=np.broadcast_to(np.asarray(temperature, float), view.t.shape).copy())


def test_temperature_places_a_further_recording(view):
    course = lambda *parts: joined_views(list(parts)).course[len(view) :]  # noqa: E731
    heating = warm(view, np.linspace(COLD + 30.0, COLD + 80.0, len(view)))
    assert np.all(course(heating, view) >= 0.5)  # unknown temperature: time continues
    assert np.all(course(heating, warm(view, COLD + 1.0)) == 0.0)
    middle = course(heating, warm(view, COLD + 55.0))
    assert np.ptp(middle) == 0.0 and middle[0] == pytest.approx(0.25, abs=0.03)  # half of the first half
    assert not started_cold(heating) and not started_cold(view)
    assert started_cold(joined_views([heating, warm(view, COLD + 1.0)]))
    assert wants_cold({"magnet_flux", "magnet_temperature"}, CATALOGUE, view)
    assert not wants_cold({"delay", "sampling_skew"}, CATALOGUE, view)
    assert not wants_cold({"magnet_temperature", "resistance_temperature"}, CATALOGUE, view)  # both would vanish


def test_cold_winding_does_not_place_a_drift(view):
    """Magnets warm by their own losses: a cold winding does not mean cold magnets."""
    cold = warm(view, COLD + 1.0)
    short = cold.take(view.run == 0).replace(span_s=0.1 * view.span_s)
    assert np.all(joined_views([cold, short]).course[len(view) :] == 1.0)
    assert not wants_cold({"magnet_flux", "magnet_temperature"}, CATALOGUE, cold)


def test_a_short_further_recording_joins_a_long_one():
    """Short dwells are cut into shorter blocks; both recordings must then be."""
    long, short = recorded(), columns(GRID)
    short = from_columns({name: values[:1600] for name, values in short.items()}, NOMINAL.sample_time_s)
    alone = [view_of(r, NOMINAL).u_dc.shape[1] for r in (long, short)]
    assert alone[0] > alone[1]
    joined = joined_views(views_of([long, short], NOMINAL))
    assert joined.u_dc.shape[1] == alone[1] and joined.t.max() > long["t"][-1]


def test_a_further_recording_of_one_point_is_fitted(view):
    """Every fourth dwell of each recording is held out, never the whole requested recording."""
    one = view.take(view.run == 0)
    for dwells in (8, 9, 10, 11):
        held = held_out([view.take(view.run < dwells), one])
        assert held.any() and len(one) > 1 and not held[-len(one) :].all()


def solution(**c):
    sure = {name: np.zeros((len(values),) * 2) for name, values in c.items()}
    view, model = SimpleNamespace(nominal=NOMINAL), SimpleNamespace(names=frozenset(c))
    return SimpleNamespace(c=c, covariance=sure, model=model, view=view)


def of(known, **c):
    """(asserted names, ambiguity sets) of a solution with nothing tied."""
    return groups(solution(**c), [], CATALOGUE, NOMINAL, **known)


def test_constant_and_drift_need_evidence_beyond_warming():
    both, psi = ["magnet_flux", "magnet_temperature"], MACHINE.magnet_flux_wb
    flux = lambda share: {"delta_psi_m": share * psi}  # noqa: E731
    drift = {"drift": -0.05 * psi}
    assert of({}, magnet_flux=flux(-0.05), magnet_temperature=drift) == (both[1:], [both])
    assert of({"cold": True}, magnet_flux=flux(-0.05), magnet_temperature=drift) == (both, [])
    assert of({}, magnet_flux=flux(+0.05), magnet_temperature=drift) == (both, [])
    # A lagging course leaves a small apparent constant.
    assert of({"cold": True}, magnet_flux=flux(-0.004), magnet_temperature=drift) == (both[1:], [])


def test_thermocouple_lag_is_small_relative_to_the_warming(view):
    """The lag causes an apparent constant resistance proportional to the temperature rise, here 100 K and not 30 K."""
    ohms = MACHINE.resistance_ohm
    hot = warm(view, np.linspace(COLD, COLD + 100.0, len(view)))
    for share, names in (
        (0.03, ["resistance_temperature"]),
        (0.06, ["resistance", "resistance_temperature"]),
    ):
        found = solution(resistance={"delta_r": share * ohms}, resistance_temperature={"alpha": 0.0039})
        found.view = hot
        assert groups(found, [], CATALOGUE, NOMINAL, cold=True) == (names, [])


def test_ohms_beyond_a_device_slope_are_a_resistance():
    i, dead = NOMINAL.machine.rated_current_a, {"v_0.02": 4.0, "v_0.12": 1.0}
    share = lambda x: {"delta_r": x * 5.0 / i}  # noqa: E731
    assert of({}, dead_time=dead, resistance=share(0.1))[0] == ["dead_time"]
    assert of({}, dead_time=dead, resistance=share(0.16)) == (["dead_time"], [["dead_time", "resistance"]])
    assert of({}, dead_time=dead, resistance=share(0.3)) == (["dead_time", "resistance"], [])
    for negative in (-0.16, -0.05):
        assert of({}, dead_time=dead, resistance=share(negative)) == (["dead_time", "resistance"], [])


def test_ohms_belong_to_a_device_only_if_its_loss_grows():
    """A drop in log(i) gives an ohmic part up to 4.7 times the growth of the loss from 0.12 to 0.3 of rated current."""
    i, both = NOMINAL.machine.rated_current_a, ["dead_time", "resistance"]

    def judged(growth, share, spread=0.0):
        dead = {"v_0.02": 4.0, "v_0.12": 1.0 - growth, "growth": growth}
        found = solution(dead_time=dead, resistance={"delta_r": share * 5.0 / i})
        found.covariance["dead_time"][2, 2] = spread**2
        return groups(found, [], CATALOGUE, NOMINAL)

    assert judged(0.6, 0.24) == (["dead_time"], [])  # 1.2 V ohmic, 0.6 V growth
    assert judged(0.3, 0.24) == (both, [])
    assert judged(0.3, 0.16) == (["dead_time"], [both])
    assert judged(0.1, 0.16) == (both, [])
    assert judged(0.05, 0.08) == (both, [])  # 0.4 V: a small share, but no growth
    assert judged(0.05, 0.08, spread=0.03) == (["dead_time"], [])  # the growth is uncertain
    assert judged(-0.1, 0.08) == (["dead_time"], [])  # a decreasing loss was not described well
    assert judged(0.1, 0.08) == (["dead_time"], [])


def test_residual_at_other_orders_is_no_evidence(view):
    """A resistance acts at order 0: a dead-time residual at order 6 does not count against it, one at order 0 does."""
    effects = {n: CATALOGUE[n] for n in ("resistance", "dead_time")}
    refiner = Refiner(view, effects, np.ones(len(view), bool))
    cells, worth = refiner.cells, lambda s, name: 2000.0
    best = refiner.refine(Model(frozenset(effects)))
    best.c["resistance"]["delta_r"], best.chi2 = 0.1, 1e6
    found = SimpleNamespace(best=best, sigma=refiner.sigma, train=np.ones(len(cells.y), bool))
    for order, names in ((6, ["resistance"]), (0, [])):
        mine = (cells.channel == "u") & (cells.order == order) & cells.ok
        best.residual = np.where(mine, np.sqrt(5000.0 / mine.sum()) * refiner.sigma, 0.0)
        assert carried(["resistance"], found, cells, worth, CATALOGUE) == names
    of_record = {"resistance": SimpleNamespace(corrects=True)}  # a measurement error acts on all orders
    best.residual = np.where((cells.order == 6) & cells.ok, refiner.sigma, 0.0) * 10.0
    assert carried(["resistance"], found, cells, worth, of_record) == []


def test_a_delay_within_half_a_dead_time_is_the_dead_time():
    bus, period = NOMINAL.inverter.dc_bus_v, NOMINAL.sample_time_s
    c = {"dead_time": {"v_0.02": 0.02 * bus, "v_0.12": 0.01 * bus}, "delay": {"tau": 1e-6}}
    for name in ("delay", "sampling_skew"):
        assert CATALOGUE[name].overshadowed(c, NOMINAL) == pytest.approx(1.1 * 0.015 * period)
        assert CATALOGUE[name].overshadowed({"delay": c["delay"]}, NOMINAL) == 0.0


def test_friction_cannot_drive_the_shaft():
    possible, sure = CATALOGUE["friction"].possible, np.diag([1e-12, 1e-12])
    viscous = NOMINAL.machine.viscous_friction_nms
    assert possible({"viscous": -0.9 * viscous, "coulomb": 0.0}, sure, NOMINAL)
    assert not possible({"viscous": -1.5 * viscous, "coulomb": 0.0}, sure, NOMINAL)
    assert possible({"viscous": -1.5 * viscous, "coulomb": 0.0}, np.diag([viscous**2, 0.0]), NOMINAL)


def test_cogging_order_is_not_its_harmonic(view):
    """More of the slow blocks resolve order 8 than order 4, so that it locks better; it is still the harmonic."""
    quiet = view.replace(torque=np.zeros(view.u_dc.shape), shaft=np.full(len(view), "torque"), memo={})
    nominal = -misfit(quiet)["torque"]
    for first, second, order in ((1.0, 0.4, 4), (0.0, 1.0, 8)):
        waves = first * np.sin(4 * view.theta_mid + 0.3) + second * np.sin(8 * view.theta_mid + 1.0)
        cogging = quiet.replace(torque=nominal + waves, memo={})
        assert {key.split("_")[0] for key in CATALOGUE["cogging"].core(cogging)} == {
            f"h{order}",
            f"h{2 * order}",
        }


def test_unbalanced_load_is_not_transducer_noise(view):
    """It differs between short blocks like noise; with a free shaft it would be noise."""
    quiet = view.replace(torque=np.zeros(view.u_dc.shape), shaft=np.full(len(view), "torque"), memo={})
    swing = 0.15 * rated_torque(NOMINAL) * np.sin(view.theta_mid / MACHINE.pole_pairs)
    heavy = quiet.replace(torque=swing - misfit(quiet)["torque"], memo={})
    for kind, kept in (("torque", True), ("unloaded", False)):
        refiner = Refiner(heavy.replace(shaft=np.full(len(view), kind)), {}, np.ones(len(view), bool))
        mean = (refiner.cells.channel == "torque") & (refiner.cells.order == 0) & (refiner.cells.part == 0)
        assert refiner.cells.ok[mean].any() == kept


def test_an_axis_without_current_has_no_curve(view):
    still = view.replace(i=1j * view.i.imag + 0.01 * view.machine.rated_current_a, memo={})
    assert set(CATALOGUE["inductance_d"].free(view)) == {"bend_2", "bend_3"}
    assert CATALOGUE["inductance_d"].free(still) == {} and CATALOGUE["inductance_q"].free(still)
    later = view.replace(memo=still.memo)  # decided once for all views of a recording
    assert CATALOGUE["inductance_d"].free(later) == {}


def test_curve_over_an_erroneous_current_adds_no_tolerance(view):
    """The corrected data have a d current that the raw data do not have."""
    still = view.replace(i=1j * view.i.imag + 0.01 * view.machine.rated_current_a, memo={})
    refiner = Refiner(still, {"saturation": CATALOGUE["saturation"]}, np.ones(len(view), bool))
    before = refiner.sigma.copy()
    refiner.allow_for_curves(solution(saturation={"d_3": 0.1}))
    assert np.array_equal(refiner.sigma, before)
    refiner.allow_for_curves(solution(saturation={"d_3": 0.1, "q_3": 0.1}))
    assert (refiner.sigma >= before).all() and (refiner.sigma > before).any()


def test_ripple_is_subtracted_only_if_the_fit_improves():
    """A set with an absurd ripple must not affect the data of the others."""
    view = view_of(recorded(machine={"inductance_q_h": 1.15 * MACHINE.inductance_q_h}), NOMINAL)
    effects = {n: CATALOGUE[n] for n in ("inductance_d", "inductance_q")}
    refiner = Refiner(view, effects, np.ones(len(view), bool))
    right = refiner.refine(Model(frozenset(["inductance_q"])))
    absurd = refiner.refine(Model(frozenset(["inductance_d"])))
    absurd.c["inductance_d"] = {"delta_l_d": 40.0 * MACHINE.inductance_d_h}
    taken = refiner.take_raw([absurd, right])
    assert taken is None or taken.model == right.model
    assert refiner.refine(right.model).dispersion < 1.5 * right.dispersion


def test_sign_change_needs_inductance_and_saturation(view):
    l_q = MACHINE.inductance_q_h
    straight = solution(inductance_q={"delta_l_q": 0.2 * l_q})
    bent = solution(saturation={"q_3": -0.3})
    turning = solution(inductance_q={"delta_l_q": 0.1 * l_q}, saturation={"q_3": -0.3})
    assert not has_both(view, straight, "q") and labels(view, straight)[0] == {"inductance_q"}
    assert not has_both(view, bent, "q") and labels(view, bent)[0] == {"saturation"}
    assert has_both(view, turning, "q") and labels(view, turning)[0] == {"inductance_q", "saturation"}


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


def test_name_must_exceed_its_uncertainty_between_points():
    """A wrong bus voltage in a few blocks only: a gain of 0.4 +- 0.8 that other blocks contradict."""
    c = {"udc_gain": {"gain": 0.4}, "friction": {"viscous": 1.0, "coulomb": 1.0}}
    either = np.array([[1.0, -1.0], [-1.0, 1.0]])  # Coulomb or viscous at one speed, but friction
    spread = SimpleNamespace(solution=SimpleNamespace(c=c), covariance={"friction": 1e-4 * np.eye(2) + 9.0 * either})
    spread.others, spread.estimates = list, lambda name, others: {}
    for sigma, names in ((0.8, ["friction"]), (0.05, ["udc_gain", "friction"])):
        spread.covariance["udc_gain"] = np.array([[sigma**2]])
        assert beyond_doubt(spread, ["udc_gain", "friction"]) == names
