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

from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.decide.credibility import credibilities
from fluxproof.diagnosis.decide.sizes import UNITS, Sizes, measured_torque
from fluxproof.diagnosis.effects import Spread
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Remainder
from fluxproof.diagnosis.inference.converge import around
from fluxproof.diagnosis.inference.fitted_set import FittedSet, covariance_of, log_too_small
from fluxproof.diagnosis.inference.judged import CLOSE, Judged, Names
from fluxproof.diagnosis.inference.search import until_it_stands

BASE = tuple(name for name, effect in CATALOGUE.items() if isinstance(effect, Spread))
KEPT = 8  # sets of a recording that go into its row
OWN = 6  # sets that are judged on their own linearisation in a round
ROUNDS = 3
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
    judged, out = _searched(posterior), []
    for fit in _close(judged)[:KEPT]:
        if np.isfinite(fit.value):
            left, share = _left(judged.setup, fit)
            extras = tuple(n for n in fit.names if n not in BASE)
            out.append(Hypothesis(extras, fit.value, credibilities(fit), tuple(estimates(fit)), left, share))
    return out


def _searched(posterior) -> Judged:
    """Sets of extras beside the spread of manufacture, ranked by the evidence for the extras."""
    best = posterior.best()
    problem = around(posterior.setup, best) or best.problem  # with the columns of every effect
    judged, least = Judged(posterior.setup, worth=_evidence), best.value - CLOSE
    base = {n for n in problem.able() if n in BASE}
    known = [fit.names for fit in posterior.fits.values() if fit.value > least]
    judged.judge(problem, sorted({_joined(base, extras) for extras in ((), *known, *((n,) for n in problem.able()))}))
    leaders(judged, ())
    until_it_stands(judged, (one_more_or_less, leaders), ROUNDS)
    return judged


def one_more_or_less(judged: Judged, best: Names):
    """Judge the best set with another extra, and without one of its own, on its linearisation."""
    fit = judged.fits[best]
    problem = around(judged.setup, fit) or fit.problem
    more = {_joined(best, (n,)) for n in problem.able()} - {best}
    judged.judge(problem, sorted(more | {tuple(n for n in best if n != out) for out in best if out not in BASE}))


def leaders(judged: Judged, best: Names):
    """Linearise the best sets."""
    for fit in _close(judged)[:OWN]:
        if not fit.own:
            judged.linearise(fit.names)


def _joined(names, others) -> Names:
    return tuple(sorted({*names, *others}))


def _close(judged) -> list[FittedSet]:
    least = judged.best().value - CLOSE
    return judged.ranked(lambda fit: fit.value > least)


def _evidence(fit) -> float:
    """Log evidence of a set without the odds of its extras; the spread of manufacture may be small."""
    odds = sum(fit.problem.setup.odds(n) for n in fit.names)
    return float(fit.value - odds - log_too_small(fit, [n for n in fit.names if n in BASE]))


def _left(setup, fit) -> tuple[tuple[Remainder, ...], float]:
    """What a set leaves above the noise floor, and its share of what there is beside the spread of manufacture."""
    every = np.ones(len(setup.view), bool)
    sizes = Sizes(setup, fit.left(BASE), fit.left(), every, measured_torque(setup))
    shares = [s.left / s.excess for s in sizes.channels.values() if s.after > s.above(k.FLOOR) and s.excess > 0.0]
    parts = tuple(dataclasses.replace(part, order=_signed(setup, part, fit.left())) for part in sizes.remainder())
    return parts, float(max(shares, default=0.0))


def _signed(setup, part, after) -> float:
    """The order with the sign of the direction that holds more of the remainder."""
    cells = setup.cells
    channel = next(c for c, (signal, _) in UNITS.items() if signal == part.signal)
    mine = cells.ok & (cells.channel == channel) & (np.abs(np.abs(cells.order) - part.order) < 1e-3)
    return -part.order if (np.sign(cells.order[mine]) @ after[mine] ** 2) < 0.0 else part.order


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
