# SPDX-License-Identifier: BSD-3-Clause
"""Sizes that are impossible or implausible, and what they cost a set of effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.recordings.slow_logs import LEVELS, NOMINAL, Truth, log
from fluxproof.diagnosis.balance.slow_view import slow_view
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground import constants
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import log_implausible, possible
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.setup import Setup

PSI, L_Q = NOMINAL.machine.magnet_flux_wb, NOMINAL.machine.inductance_q_h


@pytest.mark.parametrize("times, is_possible", [(5.0, True), (12.0, False)])
def test_absurd_sizes_are_impossible(times, is_possible):
    """What a drive file has at a fifth was impossible, and a bus sensor 127 % off was named in its place."""
    view = slow_view(log(Truth(l_q=times * L_Q)), NOMINAL)
    alone = fit_set(Problem(Setup(view, view.visible(CATALOGUE), np.ones(len(view), bool))), ("inductance_q",))
    assert possible(alone) is is_possible


def test_of_forms_that_exclude_each_other_a_possible_one_is_taken(monkeypatch):
    """A late voltage that gains amplitude stood for a late angle, so that no delay was possible at all."""
    view = slow_view(log(), NOMINAL)
    view = view.turned(2e-5 * view.omega)
    problem = Problem(Setup(view, {"delay": CATALOGUE["delay"]}, np.ones(len(view), bool)))
    assert fit_set(problem, ("delay",)).c["delay"]["angle"]
    monkeypatch.setattr(type(CATALOGUE["delay"]), "possible", lambda effect, c, *_: not c.get("angle"))
    assert fit_set(problem, ("delay",)).c["delay"]["tau"]


@pytest.mark.parametrize("share, costs", [(0.95, False), (0.6, False), (0.4, True)])
def test_an_implausible_value_costs(share, costs, monkeypatch):
    """Else a sum of absurd effects that cancel is preferred to the true ones."""
    view = slow_view(log(Truth(psi_m=share * PSI), levels=LEVELS[:8]), NOMINAL)
    problem = Problem(Setup(view, view.visible(CATALOGUE), np.ones(len(view), bool)))
    priced = fit_set(problem, ("magnet_flux",)).value
    monkeypatch.setattr(constants, "IMPLAUSIBLE", 1.0)
    assert fit_set(problem, ("magnet_flux",)).value - priced == pytest.approx(np.log(1e3) * costs)


def test_the_price_of_a_value_at_its_limit_has_no_edge():
    """Beside an L_d of 3.3 +- 0.2 of the nameplate a gain of the bus, beside one of 3.5 a magnet flux, was found."""
    view = slow_view(log(Truth(psi_m=0.45 * PSI), levels=LEVELS[:8]), NOMINAL)
    fit = fit_set(Problem(Setup(view, view.visible(CATALOGUE), np.ones(len(view), bool))), ("magnet_flux",))
    beyond = np.linspace(0.3, 4.0, 9)  # standard deviations
    covariances = ((0.05 * PSI / z) ** 2 * np.ones_like(fit.cov) for z in beyond)
    prices = [log_implausible(replace(fit, cov=covariance), fit.names) for covariance in covariances]
    steps = -np.diff(prices)
    assert prices[0] == pytest.approx(np.log(0.38), abs=0.1) and prices[-1] == pytest.approx(np.log(1e-3), abs=0.1)
    assert np.all(steps > 0.0) and steps.max() < 1.6
