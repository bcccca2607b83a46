# SPDX-License-Identifier: BSD-3-Clause
"""The iteration of a set of effects around its own solution."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from fluxproof.diagnosis.inference import converge


@pytest.fixture(autouse=True)
def problems_that_fit(monkeypatch):
    """Each problem below says itself what is fitted to it."""
    monkeypatch.setattr(converge, "fit_set", lambda problem, names: problem.fit(names))


@dataclass
class Fit:
    """What the iteration reads of a fitted set."""

    vector: np.ndarray
    c: dict
    problem: SimpleNamespace
    names: tuple = ("offset",)
    take: np.ndarray = field(default_factory=lambda: np.array([0]))
    cov: np.ndarray = field(default_factory=lambda: np.array([[1e-4]]))
    stands: bool = False
    value: float = 0.0


def fit_at(x, key="a"):
    return Fit(np.array([x]), {"offset": {key: x}}, SimpleNamespace(keys=[("offset", key), ("offset", "b")]))


def swinging(slope, goal=1.0):
    """Problems whose solution is ``slope`` times as far from the goal as the point of their linearisation."""
    at = []

    def problem(setup, c, names):
        at.append(c["offset"]["a"])
        return SimpleNamespace(fit=lambda names: fit_at(goal + slope * (at[-1] - goal)))

    return problem, at


@pytest.mark.parametrize("slope", [-1.4, -1.0, -0.3, 0.0, 0.5])
def test_steps_that_swing_are_damped(monkeypatch, slope):
    monkeypatch.setattr(converge, "_at", swinging(slope)[0])
    found = converge.converged(None, fit_at(5.0), 14)
    assert found.stands and found.vector[0] == pytest.approx(1.0, abs=0.01)


def test_steps_that_shrink_are_not_damped(monkeypatch):
    problem, at = swinging(0.01)
    monkeypatch.setattr(converge, "_at", problem)
    assert converge.converged(None, fit_at(5.0), 14).stands and len(at) <= 4


def test_a_set_whose_columns_change_does_not_stand(monkeypatch):
    """The first fit had other columns: without a second step nothing is known of their iteration."""
    problem, at = swinging(0.0)
    monkeypatch.setattr(converge, "_at", problem)
    first = fit_at(1.0)
    first.take = np.array([1])
    assert converge.converged(None, first, 14).stands and len(at) == 2


def test_an_impossible_linearisation_is_none(monkeypatch):
    monkeypatch.setattr(converge, "_at", lambda *arguments: None)
    assert converge.converged(None, fit_at(5.0), 3) is None


def test_a_column_may_vanish_between_two_steps():
    one, other = {"skew": {"tau": 2.0}}, {"skew": {"tau": 4.0, "pulses": 6.0}}
    assert converge._halfway(one, other) == converge._halfway(other, one) == {"skew": {"tau": 3.0, "pulses": 3.0}}


def test_a_set_that_falls_below_what_has_weight_is_given_up(monkeypatch):
    """One that was good on the linearisation of another set only: twelve steps of it were most of a search's time."""
    at = []

    def problem(setup, c, names):
        at.append(c["offset"]["a"])
        fit = fit_at(at[-1] + 1.0)
        fit.value = -10.0 * len(at)
        return SimpleNamespace(fit=lambda names: fit)

    monkeypatch.setattr(converge, "_at", problem)
    first = fit_at(0.0)
    first.value = 0.0
    assert not converge.converged(None, first, 14, least=-25.0).stands and len(at) == 4
