# SPDX-License-Identifier: BSD-3-Clause
"""A set of effects on its own linearisation: the columns around the solution, until both agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import FittedSet
from fluxproof.diagnosis.inference.linearise import frozen, linearised
from fluxproof.diagnosis.inference.problem import Problem

STANDS = 0.1  # standard deviations: a smaller change of every coefficient ends the iteration
SHRINKS = 0.7  # of the last step: from a longer one on, all are damped


def around(setup, fit, names=None):
    """The problem linearised at a fit, or None; names: effects whose columns are needed (None: all).

    The misfit keeps its noise: only what a correction changes in the smooth signals, and in ripple that repeats in
    every block of an operating point, is applied.  Otherwise a correction that filters or scales noise would be
    rewarded.
    """
    return _at(setup, fit.c, names)


def _at(setup, c, names):
    at = setup.call(linearised, setup.rows, frozen(c), names)
    return None if at is None else setup.call(Problem, setup, at)


def moved(fit, before) -> float:
    """Largest change of a coefficient in standard deviations; infinite if the columns changed."""
    if _columns(fit) != _columns(before):
        return np.inf
    own = np.sqrt(np.maximum(np.diag(fit.cov), 0.0))
    return float(np.max(np.abs(fit.vector - before.vector) / np.maximum(own, 1e-300), initial=0.0))


def _columns(fit) -> list:
    return [fit.problem.keys[n] for n in fit.take]


def _halfway(one, other):
    """Coefficients in the middle of two; one that has no column at the other is zero there."""
    return {
        name: {key: 0.5 * (one[name].get(key, 0.0) + own.get(key, 0.0)) for key in {**one[name], **own}}
        for name, own in other.items()
    }


def converged(setup, fit, steps, least=-np.inf) -> FittedSet | None:
    """A set of effects on its own linearisation, or None; steps: at most so many.

    If steps stop shrinking (for example where a small current changes sign), every further step is halved.  A set whose
    log posterior is below ``least`` and still falls is given up: where it stands, it has no weight.
    """
    at, last, damped = fit.c, np.inf, False
    for _ in range(steps):
        problem = _at(setup, at, fit.names)
        if problem is None:
            return None
        new = fit_set(problem, fit.names)
        step = moved(new, fit)
        if step < STANDS:
            return replace(new, stands=True)
        if new.value < fit.value < least:
            return new
        damped |= SHRINKS * last < step < np.inf
        at = _halfway(at, new.c) if damped else new.c
        fit, last = new, step
    return fit


def fit_at(setup, c) -> FittedSet | None:
    """A set of effects on the linearisation at its coefficients c, or None."""
    problem = _at(setup, c, tuple(c))
    return None if problem is None else fit_set(problem, tuple(c))


def fit_of_set(setup, names, steps=3) -> FittedSet:
    """A set of effects on its own linearisation, from the recording as it is."""
    fit = fit_set(Problem(setup), names)
    return converged(setup, fit, steps) or fit
