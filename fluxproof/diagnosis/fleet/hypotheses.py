# SPDX-License-Identifier: BSD-3-Clause
"""Effects of one recording beyond normal production tolerance: sets of effects with their evidence, for the fleet.

No two drives have the same resistance, inductances and magnet flux, so these are in every set whether or not they reach
the size of practical interest: an estimate that is reported only if it is large would bias the population's mean and
spread.  What else a set contains are its extras.  Their prior is left out here; rates.py learns it from the fleet.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.answer.conclude import measured_torque
from fluxproof.diagnosis.answer.names import credibilities
from fluxproof.diagnosis.answer.sizes import UNITS, Sizes
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.effects import Spread
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Remainder
from fluxproof.diagnosis.inference.posterior import possible
from fluxproof.diagnosis.inference.problem import covariance_of, log_too_small
from fluxproof.diagnosis.inference.settle import around, settled

BASE = tuple(name for name, effect in CATALOGUE.items() if isinstance(effect, Spread))
CLOSE = 20.0  # log evidence below the best within which a set is kept: e^-20 is no alternative at any rate
KEPT = 8  # sets of a recording that go into its row
OWN = 6  # sets that are judged on their own linearisation in a round
ROUNDS = 4
STEPS = 3  # linearisations of one set
UNKNOWN = 1e-6  # information, in units of the prior's, of a direction of which the data say nothing


@dataclass(frozen=True)
class Estimated:
    """A parameter as the recording alone sees it: without the prior of its size, so that it can be pooled."""

    effect: str
    parameter: str
    value: float
    sigma: float
    unit: str


@dataclass(frozen=True)
class Hypothesis:
    """A set of extras: log evidence without the odds of the extras, {effect: credibility}, parameters of the set.

    left: what it leaves of the misfit, per signal and order; left_share: of the power above the noise floor that is
    there beside the spread of manufacture, in the signal of which most is left.
    """

    extras: tuple[str, ...]
    evidence: float
    credible: dict[str, float]
    estimates: tuple[Estimated, ...]
    left: tuple[Remainder, ...] = ()
    left_share: float | None = None


def hypotheses(posterior) -> list[Hypothesis]:
    """The sets of extras that a recording leaves open, the best first."""
    return _Search(posterior).found()


class _Search:
    """Sets of extras, first on the linearisation of the best one, then on their own."""

    def __init__(self, posterior):
        self.setup, best = posterior.setup, posterior.best()
        problem = around(self.setup, best) or best.problem  # with the columns of every effect
        able = problem.able()
        self.base = tuple(n for n in BASE if n in able)
        self.able = [n for n in able if n not in self.base]
        self.fits, self.own = {}, set()
        known = sorted(posterior.fits.values(), key=lambda f: -f.value)
        first = {self._extras(f.names) for f in known if f.value > known[0].value - CLOSE}
        self._add(problem, {(), *first, *((n,) for n in self.able)})
        self._run()

    def _extras(self, names) -> tuple[str, ...]:
        return tuple(sorted(n for n in names if n not in self.base))

    def _run(self):
        seen = None
        for _ in range(ROUNDS):
            for extras in self._best(OWN):
                self._linearise(extras)
            best = self._best(1)[0]
            if best == seen:
                return
            seen = best
            near = {tuple(sorted({*best, n})) for n in self.able if n not in best}
            near |= {tuple(n for n in best if n != out) for out in best}
            self._add(self.fits[best].problem_of_all(self.setup), near)

    def _best(self, count) -> list[tuple[str, ...]]:
        ranked = sorted(self.fits, key=lambda e: (-self.fits[e].value, e))
        top = self.fits[ranked[0]].value
        return [e for e in ranked[:count] if self.fits[e].value > top - CLOSE]

    def _add(self, problem, sets):
        for extras in sorted(sets):
            if extras not in self.own:
                self.fits[extras] = _Judged(self._fit(problem, extras), self.base)

    def _fit(self, problem, extras):
        return problem.fit((*self.base, *extras))

    def _linearise(self, extras):
        if extras in self.own:
            return
        self.own.add(extras)
        found = settled(self.setup, self.fits[extras].fit, STEPS)
        if found is None:
            self.fits[extras].value = -np.inf
        else:
            self.fits[extras] = _Judged(found, self.base)

    def found(self) -> list[Hypothesis]:
        out = []
        for extras in self._best(KEPT):
            judged = self.fits[extras]
            if not np.isfinite(judged.value):
                continue
            credible = credibilities(judged.fit)
            left, share = self._left(judged.fit)
            out.append(Hypothesis(extras, judged.value, credible, tuple(estimates(judged.fit)), left, share))
        return out

    def _left(self, fit) -> tuple[tuple[Remainder, ...], float]:
        """What a set leaves above the noise floor, and its share of what there is beside the spread of manufacture."""
        setup = self.setup
        every = np.ones(len(setup.view), bool)
        sizes = Sizes(setup, fit.left(self.base), fit.left(), every, measured_torque(setup))
        shares = [s.left / s.excess for s in sizes.channels.values() if s.after > s.above(k.FLOOR) and s.excess > 0.0]
        parts = tuple(dataclasses.replace(part, order=self._signed(part, fit.left())) for part in sizes.remainder())
        return parts, float(max(shares, default=0.0))

    def _signed(self, part, after) -> float:
        """The order with the sign of the direction that holds more of the remainder."""
        cells = self.setup.cells
        channel = next(c for c, (signal, _) in UNITS.items() if signal == part.signal)
        mine = cells.ok & (cells.channel == channel) & (np.abs(np.abs(cells.order) - part.order) < 1e-3)
        return -part.order if (np.sign(cells.order[mine]) @ after[mine] ** 2) < 0.0 else part.order


class _Judged:
    """A fit with the evidence for its extras."""

    def __init__(self, fit, base):
        self.fit = fit
        odds = sum(fit.problem.setup.odds(n) for n in fit.names)
        spread = log_too_small(fit, [n for n in fit.names if n in base])  # of manufacture, which may be small
        self.value = float(fit.value - odds - spread) if possible(fit) else -np.inf

    def problem_of_all(self, setup):
        """The linearisation at this fit with the columns of every effect."""
        return around(setup, self.fit) or self.fit.problem


def estimates(fit) -> list[Estimated]:
    """Parameters of a fit's effects, as maximum-likelihood values with the covariance of the data alone."""
    values, covariance = without_prior(fit)
    nominal, effects = fit.problem.view.nominal, fit.problem.setup.effects
    out = []
    place = {fit.problem.keys[n]: j for j, n in enumerate(fit.take)}
    for name in fit.names:
        c = dict(fit.c[name])
        for key in c:
            if (name, key) in place:
                c[key] = float(values[place[name, key]])
        found = effects[name].estimates(c, covariance_of(fit, name, covariance), nominal)
        out += [Estimated(name, key, float(e.value), float(e.sigma), e.unit) for key, e in found.items()]
    return out


def without_prior(fit) -> tuple[np.ndarray, np.ndarray]:
    """(coefficients (k,), covariance (k, k)) of a fit whose formulas have no prior; free curves keep theirs.

    The posterior precision is that of the data plus 1 / sd^2 of the prior: taking the latter away from the formula's
    columns leaves what the data say.  A direction of which they say nothing gets a sigma of 1000 prior sizes.
    """
    owner = np.array([fit.names.index(fit.problem.keys[n][0]) for n in fit.take], int)
    core = np.array([fit.problem.keys[n] not in fit.problem.cells.free for n in fit.take], bool)
    sd = fit.sizes[owner] * fit.problem.prior[fit.take]
    precision = np.linalg.inv(fit.cov / np.outer(sd, sd))  # in units of the prior: well conditioned
    right = precision @ (fit.vector / sd)
    data = precision - np.diag(np.where(core, 1.0, 0.0))
    known, axes = np.linalg.eigh(0.5 * (data + data.T))
    covariance = (axes / np.maximum(known, UNKNOWN)) @ axes.T
    return covariance @ right * sd, covariance * np.outer(sd, sd)
