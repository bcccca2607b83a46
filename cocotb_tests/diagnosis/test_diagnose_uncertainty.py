"""How sure a diagnosis is of its parameters, and the corrections without which no interval could be right."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import DRIVE, MACHINE, POINT, columns, recorded
from fluxproof.diagnosis.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.fit import Model
from fluxproof.diagnosis.nominal import load_nominal
from fluxproof.diagnosis.recording import from_columns
from fluxproof.diagnosis.refine import Refiner
from fluxproof.diagnosis.result import Estimate
from fluxproof.diagnosis.uncertainty import Plain, Spread, larger
from fluxproof.diagnosis.verdict import beyond_doubt, named

NOMINAL = load_nominal(PAPER)
T = NOMINAL.sample_time_s


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def fitted(view, *names, effects=None):
    """(refiner, solution) of a set of effects on a view, all blocks fitted."""
    refiner = Refiner(view, effects or {n: CATALOGUE[n] for n in names}, np.ones(len(view), bool))
    return refiner, refiner.refine(Model(frozenset(names)))


def test_larger_covariance_bounds_both():
    rng = np.random.default_rng(3)
    for _ in range(20):
        a, b = ((m := rng.standard_normal((4, 4))) @ m.T + 0.1 * np.eye(4) for _ in range(2))
        both = larger(a, b)
        assert min(np.linalg.eigvalsh(both - a).min(), np.linalg.eigvalsh(both - b).min()) > -1e-9
        assert np.allclose(larger(a, 1e-3 * a), a)


def test_error_common_to_an_operating_point_increases_sigma(view):
    refiner, calm = fitted(view, "magnet_flux")
    before = Spread(refiner, calm, 1.0).covariance["magnet_flux"][0, 0]
    dwell = view.run[refiner.cells.block]
    push = np.random.default_rng(1).standard_normal(dwell.max() + 1)[
        dwell
    ]  # the same in all blocks of a dwell
    mean = (refiner.cells.order == 0) & (refiner.cells.channel == "u") & (refiner.cells.part == 1)
    refiner.adjust = np.where(mean, 4.0 * refiner.sigma * push, 0.0)
    refiner.linear.y += (refiner.adjust / refiner.sigma)[refiner.linear.use]
    pushed = Spread(refiner, calm, 1.0).covariance["magnet_flux"][0, 0]
    assert pushed > 4.0 * before


def test_common_error_of_the_balance_does_not_average_out(view):
    """However many blocks there are, the magnets' flux is not known better than the voltage is balanced."""
    refiner, solution = fitted(view, "magnet_flux")
    spread = Spread(refiner, solution, 1e-9)
    assert np.sqrt(spread._common()[0, 0]) == pytest.approx(2e-5 * MACHINE.magnet_flux_wb, rel=0.5)
    without = spread.covariance["magnet_flux"][0, 0] - spread._common()[0, 0]
    assert 0.0 < without < spread.covariance["magnet_flux"][0, 0]


def test_unnamed_small_effect_increases_sigma():
    """Magnets 2 % weak, and resistance in error by less than a name: the flux may be off by what that moves it."""
    r = MACHINE.resistance_ohm
    view = view_of(recorded(machine={"resistance_ohm": 1.008 * r}), NOMINAL)
    effects = {n: CATALOGUE[n] for n in ("magnet_flux", "inductance_d", "resistance")}
    refiner, solution = fitted(view, "magnet_flux", effects=effects)
    spread = Spread(refiner, solution, solution.dispersion)
    others = spread.others()
    alone = spread.estimates("magnet_flux", [])["magnet_flux_wb"]
    together = spread.estimates("magnet_flux", others)["magnet_flux_wb"]
    beside = refiner.refine(Model(frozenset(["magnet_flux", "resistance"])))
    moved = beside.c["magnet_flux"]["delta_psi_m"] - solution.c["magnet_flux"]["delta_psi_m"]
    assert others and together.value == alone.value
    assert together.sigma == pytest.approx(np.hypot(alone.sigma, moved), rel=0.05)
    assert not Spread(*fitted(view, "magnet_flux", "resistance", effects=effects), 1.0).others()


def test_a_delay_of_a_whole_period_is_found_without_bias(view):
    """The linear estimate lies past the whole period; the correction must let it come back."""
    early = view.u.copy()
    early[:, :-1] = view.u[:, 1:]  # recorded a row before it acts
    late = view.replace(u=early, theta=view.theta, memo={})
    refiner, solution = fitted(late, "delay")
    tau, sigma = solution.c["delay"]["tau"], float(np.sqrt(solution.covariance["delay"][0, 0]))
    assert abs(tau - T) < 3.0 * sigma and abs(tau - T) < 2e-3 * T
    further = (
        CATALOGUE["delay"].corrected(late, {"tau": 1.1 * T}).u
        - CATALOGUE["delay"].corrected(late, {"tau": T}).u
    )
    assert np.abs(further[:, 1:]).max() > 0.0


def test_iron_loss_current_follows_the_remaining_flux(view):
    """i_fe = j omega g psi(i - i_fe), solved exactly for both axes, against what the iron loss takes off the flux."""
    m, g = view.machine, 0.02 * view.machine.rated_current_a / (400.0 * view.machine.magnet_flux_wb)
    # psi_d = psi0_d + L_d w g psi_q, psi_q = psi0_q - L_q w g psi_d
    a, b = m.inductance_d_h * view.omega * g, m.inductance_q_h * view.omega * g
    psi = view.psi
    d = (psi.real + a * psi.imag) / (1.0 + a * b)
    q = psi.imag - b * d
    exact = d + 1j * q - psi
    taken = CATALOGUE["iron_loss"].psi(view, {"g_fe": g})
    first = -view.inductances(1j * view.omega * g * psi)
    assert np.abs(taken - exact).max() < 0.1 * np.abs(first - exact).max()


def test_iron_loss_size():
    g = 0.04 * NOMINAL.machine.rated_current_a / (640.0 * MACHINE.magnet_flux_wb)
    view = view_of(recorded(machine={"iron_conductance_s": g}), NOMINAL)
    _, solution = fitted(view, "iron_loss")
    found = solution.c["iron_loss"]["g_fe"]
    linear = Refiner(view, {"iron_loss": CATALOGUE["iron_loss"]}, np.ones(len(view), bool)).linear
    first = linear.solve(solution.model).c["iron_loss"]["g_fe"]
    assert abs(found - g) < abs(first - g)


def test_skew_is_relative_to_the_angle():
    estimates = CATALOGUE["sampling_skew"].estimates
    c, covariance = {"tau": 0.2e-6, "angle": -0.8e-6}, np.array([[4.0, 3.9], [3.9, 4.0]]) * 1e-14
    skew = estimates(c, covariance, NOMINAL)["skew_s"]
    assert skew.value == pytest.approx(1e-6) and skew.sigma == pytest.approx(np.sqrt(0.2e-14))
    assert estimates({"tau": 0.3e-6}, covariance[:1, :1], NOMINAL)["skew_s"].value == pytest.approx(0.3e-6)


def test_resistance_asymmetry_is_relative_to_the_true_resistance():
    """Phases 10 % apart in a winding of 1.3 times the nameplate's ohms: not 13 %, though that cannot be excluded."""
    apart, names = (0.1, -0.05, -0.05), ("resistance", "phase_resistance_asymmetry")
    machine = {"resistance_ohm": 1.3 * MACHINE.resistance_ohm, "phase_resistance_asymmetry": apart}
    _, solution = fitted(view_of(recorded(machine=machine), NOMINAL), *names)
    empty = SimpleNamespace(chi2=2.0 * solution.chi2, rows=1.0)
    effects = {e.name: e for e in named(Plain(solution, CATALOGUE, NOMINAL, 1.0), names, empty)}
    found = effects["phase_resistance_asymmetry"]
    values = [found.parameters[f"asymmetry_{x}"].value for x in "abc"]
    assert values == pytest.approx(apart, abs=2e-3)
    assert found.plant["machine.phase_resistance_asymmetry"] == pytest.approx(values)
    assert found.parameters["asymmetry_a"].sigma == pytest.approx(0.03, rel=0.1)
    alone = named(Plain(solution, CATALOGUE, NOMINAL, 1.0), names[1:], empty)[0].parameters["asymmetry_a"]
    assert alone.value == pytest.approx(1.3 * values[0], rel=0.01) and alone.sigma < 0.01


def test_coulomb_and_viscous_friction_are_collinear_at_one_speed():
    """A drag of 0.3 Nm at one speed: any part of it may be the one or the other, their sum is known."""
    table, p = dict(columns(POINT)), MACHINE.pole_pairs
    turns = np.exp(1j * table["theta_e"])
    i = (2 / 3) * sum(table[f"i_{x}"] * np.exp(2j * np.pi / 3 * k) for k, x in enumerate("abc")) / turns
    psi = MACHINE.magnet_flux_wb + (MACHINE.inductance_d_h - MACHINE.inductance_q_h) * i.real
    omega = table["omega_e"] / p
    table["torque"] = 1.5 * p * psi * i.imag - MACHINE.viscous_friction_nms * omega - 0.3
    view = view_of(from_columns(table, DRIVE.sample_time_s), NOMINAL)
    spread = Spread(*fitted(view, "friction"), 1.0)
    found = spread.estimates("friction", [])
    viscous, dry = found["viscous_friction_nms"], found["coulomb_friction_nm"]
    speed = float(omega.mean())
    assert dry.value + (viscous.value - MACHINE.viscous_friction_nms) * speed == pytest.approx(0.3, rel=0.03)
    assert dry.sigma == pytest.approx(0.3, rel=0.03) and viscous.sigma * speed == pytest.approx(0.3, rel=0.03)
    both = np.array([speed, 1.0])
    assert np.sqrt(both @ spread.covariance["friction"][:2, :2] @ both) < 0.03


def test_undetermined_parameters_are_omitted():
    """Without current on an axis, or without an order, nothing is known of its curve: it is not zero."""
    of = lambda name, *c: CATALOGUE[name].estimates(dict(c), np.diag([(1e-3 * v) ** 2 for _, v in c]), NOMINAL)  # noqa: E731
    assert set(of("saturation", ("q_3", -0.1))) == {"psi_q_change_at_rated_wb"}
    assert set(of("saturation", ("q_3", -0.1), ("d_3", 0.1))) == {f"psi_{x}_change_at_rated_wb" for x in "dq"}
    waves = [(f"h6_{k}", 0.01) for k in range(4)] + [(f"h12_{k}", 0.0) for k in range(4)]
    assert set(of("emf_harmonics", *waves)) == {"order_6"}
    assert set(of("emf_harmonics", *waves[:4], *((k, 0.01) for k, _ in waves[4:]))) == {"order_6", "order_12"}


@pytest.mark.parametrize(("known", "stays"), [((3.0, 0.1), True), ((0.6, 0.1), True), ((0.4, 0.1), False)])
def test_name_without_a_significant_parameter_is_dropped(known, stays):
    """However well it fits: values beside standard deviations of one; friction's two parts may hold each other's."""
    spread = SimpleNamespace(
        solution=SimpleNamespace(c={"friction": {"viscous": 5.0, "coulomb": 5.0}}),
        covariance={"friction": np.eye(2)},
        others=list,
        estimates=lambda name, others: {str(k): Estimate(v, 1.0, "Nm") for k, v in enumerate(known)},
    )
    assert beyond_doubt(spread, ["friction"]) == ["friction"] * stays
