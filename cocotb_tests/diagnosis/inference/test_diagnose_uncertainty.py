# SPDX-License-Identifier: BSD-3-Clause
"""Uncertainty of the parameters, and the corrections on which correct intervals depend."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import DRIVE, MACHINE, POINT, columns, recorded
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.effects import Wave
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.inference.converge import fit_of_set
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import covariance_of
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.setup import Setup

NOMINAL = load_nominal(PAPER)
T = NOMINAL.sample_time_s


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def setup_of(view, *names) -> Setup:
    """What the fits of these effects share; all blocks are fitted."""
    return Setup(view, {n: CATALOGUE[n] for n in names}, np.ones(len(view), bool))


def fitted(view, *names):
    """A set of effects on a view, and its parameters {effect: {name: Estimate}}."""
    fit = fit_of_set(setup_of(view, *names), names)
    return fit, {n: CATALOGUE[n].estimates(fit.c[n], covariance_of(fit, n, fit.cov), NOMINAL) for n in names}


def test_a_delay_of_a_whole_period_is_found_without_bias(view):
    """The linear estimate exceeds the period; the iteration must be able to return."""
    early = view.u.copy()
    early[:, :-1] = view.u[:, 1:]  # recorded a row before it acts
    late = view.replace(u=early, theta=view.theta, memo={})
    _, parameters = fitted(late, "delay")
    tau, sigma = parameters["delay"]["delay_s"].value, parameters["delay"]["delay_s"].sigma
    assert abs(tau - T) < 3.0 * sigma and abs(tau - T) < 2e-3 * T
    further = CATALOGUE["delay"].corrected(late, {"tau": 1.1 * T}).u - CATALOGUE["delay"].corrected(late, {"tau": T}).u
    assert np.abs(further[:, 1:]).max() > 0.0


def test_iron_loss_current_follows_the_remaining_flux(view):
    """i_fe = j omega g psi(i - i_fe), solved for both axes, against the flux reduction of the iron loss."""
    m, g = view.machine, 0.02 * view.machine.rated_current_a / (400.0 * view.machine.magnet_flux_wb)
    # psi_d = psi0_d + L_d w g psi_q, psi_q = psi0_q - L_q w g psi_d
    a, b = m.inductance_d_h * view.omega * g, m.inductance_q_h * view.omega * g
    psi = view.psi
    d = (psi.real + a * psi.imag) / (1.0 + a * b)
    q = psi.imag - b * d
    exact = d + 1j * q - psi
    taken = CATALOGUE["iron_loss"].lost_flux(view, {"g_fe": g})
    first = -view.inductances(1j * view.omega * g * psi)
    assert np.abs(taken - exact).max() < 0.1 * np.abs(first - exact).max()


def test_iron_loss_size():
    g = 0.04 * NOMINAL.machine.rated_current_a / (640.0 * MACHINE.magnet_flux_wb)
    view = view_of(recorded(machine={"iron_conductance_s": g}), NOMINAL)
    fit, _ = fitted(view, "iron_loss")
    found = sum(fit.c["iron_loss"].values())
    first = sum(fit_set(Problem(fit.problem.setup), ["iron_loss"]).c["iron_loss"].values())
    assert abs(found - g) < abs(first - g)


def test_skew_is_relative_to_the_angle():
    estimates = CATALOGUE["sampling_skew"].estimates
    c, covariance = {"tau": 0.2e-6, "angle": -0.8e-6}, np.array([[4.0, 3.9], [3.9, 4.0]]) * 1e-14
    skew = estimates(c, covariance, NOMINAL)["skew_s"]
    assert skew.value == pytest.approx(1e-6) and skew.sigma == pytest.approx(np.sqrt(0.2e-14))
    assert estimates({"tau": 0.3e-6}, covariance[:1, :1], NOMINAL)["skew_s"].value == pytest.approx(0.3e-6)


def test_resistance_asymmetry_is_relative_to_the_true_resistance():
    """10 % asymmetry in a winding with 1.3 times the nameplate resistance: not 13 %, though not excluded."""
    apart, names = (0.1, -0.05, -0.05), ("resistance", "phase_resistance_asymmetry")
    machine = {"resistance_ohm": 1.3 * MACHINE.resistance_ohm, "phase_resistance_asymmetry": apart}
    answer = diagnose(recorded(machine=machine), NOMINAL)
    found = {e.name: e for e in answer.effects}["phase_resistance_asymmetry"]
    assert {e.name for e in answer.effects} == set(names)
    values = [found.parameters[f"asymmetry_{x}"].value for x in "abc"]
    assert values == pytest.approx(apart, abs=4e-3)
    assert found.plant["machine.phase_resistance_asymmetry"] == pytest.approx(values)
    assert found.parameters["asymmetry_a"].sigma == pytest.approx(0.03, rel=0.1)


def test_coulomb_and_viscous_friction_are_collinear_at_one_speed():
    """A drag of 0.3 Nm at one speed: the split is known as far as its prior says, the sum by the recording."""
    table, p = dict(columns(POINT)), MACHINE.pole_pairs
    turns = np.exp(1j * table["theta_e"])
    i = (2 / 3) * sum(table[f"i_{x}"] * np.exp(2j * np.pi / 3 * k) for k, x in enumerate("abc")) / turns
    psi = MACHINE.magnet_flux_wb + (MACHINE.inductance_d_h - MACHINE.inductance_q_h) * i.real
    omega = table["omega_e"] / p
    table["torque"] = 1.5 * p * psi * i.imag - MACHINE.viscous_friction_nms * omega - 0.3
    view = view_of(from_columns(table, DRIVE.sample_time_s), NOMINAL)
    fit, parameters = fitted(view, "friction")
    found = parameters["friction"]
    viscous, dry = found["viscous_friction_nms"], found["coulomb_friction_nm"]
    speed = float(omega.mean())
    assert dry.value + (viscous.value - MACHINE.viscous_friction_nms) * speed == pytest.approx(0.3, rel=0.03)
    assert abs(dry.value - 0.3) < 2.0 * dry.sigma and dry.sigma > 0.1 * 0.3
    both = np.array([speed, 1.0])
    covariance = covariance_of(fit, "friction", fit.cov)
    assert list(fit.c["friction"])[:2] == ["viscous", "coulomb"]
    assert np.sqrt(both @ covariance[:2, :2] @ both) < 0.1 * 0.3


def test_undetermined_parameters_are_omitted():
    """Without current on an axis, or without an order, its parameter is unknown and not zero."""
    of = lambda name, *c: CATALOGUE[name].estimates(dict(c), np.diag([(1e-3 * v) ** 2 for _, v in c]), NOMINAL)  # noqa: E731
    assert set(of("saturation", ("q_3", -0.1))) == {"psi_q_change_at_rated_wb"}
    assert set(of("saturation", ("q_3", -0.1), ("d_3", 0.1))) == {f"psi_{x}_change_at_rated_wb" for x in "dq"}
    waves = [(Wave(h, part), size) for h, size in ((6, 0.01), (12, 0.0)) for part in ("fc", "fs", "bc", "bs")]
    assert set(of("emf_harmonics", *waves)) == {"order_6"}
    assert set(of("emf_harmonics", *waves[:4], *((k, 0.01) for k, _ in waves[4:]))) == {"order_6", "order_12"}
