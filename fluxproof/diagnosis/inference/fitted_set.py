# SPDX-License-Identifier: BSD-3-Clause
"""A set of effects fitted to a linear problem: coefficients, covariance, sizes, and its log posterior."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fluxproof.diagnosis.effects import believable, plausible_range
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.inference.problem import Problem


@dataclass(frozen=True, eq=False)
class FittedSet:
    """What the evidence of a set finds on a problem (inference/problem.py)."""

    problem: Problem
    names: tuple[str, ...]  # sorted
    value: float  # log posterior, not normalised; -inf: an impossible set
    take: np.ndarray  # (k,) int, columns of the problem
    vector: np.ndarray  # (k,) their coefficients
    cov: np.ndarray  # (k, k)
    sizes: np.ndarray  # (effects,) in units of the floor
    lam: np.ndarray  # (groups,) discrepancy
    mu: np.ndarray  # (groups,) share of the curves' errors that is seen
    own: bool = False  # the problem was linearised for this set
    stands: bool = False  # the problem is linearised at this fit

    @cached_property
    def c(self) -> dict[str, dict[str, float]]:
        """{effect: {coefficient: value}}."""
        c = {name: {} for name in self.names}
        for n, v in zip(self.take, self.vector, strict=True):
            name, key = self.problem.keys[n]
            c[name][key] = float(v)
        for name in self.names:
            for key in self.problem.coefficients[name]:
                c[name].setdefault(key, 0.0)
        return c

    @cached_property
    def places(self) -> dict[str, list[int]]:
        """{effect: places of its coefficients in ``vector``}."""
        owners = [self.problem.keys[n][0] for n in self.take]
        return {name: [place for place, owner in enumerate(owners) if owner == name] for name in self.names}

    @property
    def variance(self) -> np.ndarray:
        """(n,) of means and contrasts: noise, discrepancy and errors of the curves."""
        p = self.problem.p
        return p.s2 + (self.lam[p.group] * p.level) ** 2 + (self.mu[p.group] * p.doubt) ** 2

    def left(self, names=None) -> np.ndarray:
        """(r,) remainder of the misfit if the effects ``names`` (None: all of the set) explain their part."""
        out = self.problem.y.copy()
        for n, v in zip(self.take, self.vector, strict=True):
            owner, key = self.problem.keys[n]
            if names is None or owner in names:
                out -= v * self.problem.cells.columns[owner][key]
        return out


def covariance_of(fit: FittedSet, name: str, full: np.ndarray) -> np.ndarray:
    """The covariance of one effect's coefficients in their order in ``fit.c``; full: (k, k) of the set's columns."""
    out = np.zeros((len(fit.c[name]),) * 2)
    mine = fit.places[name]  # next to each other; what was estimated comes first in fit.c
    if mine:
        own = slice(mine[0], mine[-1] + 1)
        out[: len(mine), : len(mine)] = full[own, own]
    return out


def implausible(fit: FittedSet) -> int:
    """Number of the parameters of a set beyond what their effects declare as plausible."""
    nominal = fit.problem.view.nominal
    return sum(not believable(e, limits, nominal) for name in fit.names for e, limits in _declared(fit, name))


def log_implausible(fit: FittedSet, names) -> float:
    """Log prior of the effects ``names`` of a set as far as parameters are beyond what is plausible.

    Each costs the odds ``IMPLAUSIBLE`` with the probability that it is beyond: with a limit at two standard deviations,
    an inductance of 3.3 +- 0.2 of the nameplate decided between a magnet flux and a gain of the bus beside it.
    """
    nominal, odds = fit.problem.view.nominal, []
    for e, limits in (entry for name in names for entry in _declared(fit, name)):
        low, high = plausible_range(limits, nominal)
        spread = max(e.sigma, 1e-300) if np.isfinite(e.sigma) else 1e-300
        inside = _below((high - e.value) / spread) - _below((low - e.value) / spread)
        odds.append(inside + (1.0 - inside) * k.IMPLAUSIBLE)
    return float(np.sum(np.log(odds)))


def _below(z) -> float:
    """The normal distribution."""
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def _declared(fit, name) -> list:
    """[(Estimate, limits)] of the parameters of an effect of which a plausible range is known."""
    effect, nominal = fit.problem.setup.effects[name], fit.problem.view.nominal
    if not effect.plausible:
        return []
    found = effect.estimates(fit.c[name], covariance_of(fit, name, fit.cov), nominal)
    return [(found[key], limits) for key, limits in effect.plausible.items() if key in found]


def log_too_small(fit: FittedSet, names) -> float:
    """Log prior of the effects ``names`` of a set as far as they are smaller than what is of practical interest."""
    effects, nominal = fit.problem.setup.effects, fit.problem.view.nominal
    sizes = [max(effects[n].size(fit.c[n], nominal) / effects[n].floor(nominal), 1e-30) for n in names]
    return k.SMALLER * sum(min(float(np.log(size)), 0.0) for size in sizes)


def possible(fit: FittedSet, names=None) -> bool:
    """Whether no effect of a set has an impossible size or, beyond its uncertainty, an impossible sign.

    names: the effects that are asked for; None: all of the set.
    """
    problem = fit.problem
    for name in fit.names if names is None else names:
        effect, c = problem.setup.effects[name], fit.c[name]
        if effect.too_large(c, problem.setup.view):
            return False
        if not effect.possible(c, covariance_of(fit, name, fit.cov), problem.view.nominal):
            return False
    return True
