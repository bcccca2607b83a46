# SPDX-License-Identifier: BSD-3-Clause
"""The fit of a set of effects to a linear problem: its most probable sizes, its log posterior."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.effects import Alternatives
from fluxproof.diagnosis.effects.search import log_choice
from fluxproof.diagnosis.inference.evidence import evidence
from fluxproof.diagnosis.inference.fitted_set import FittedSet, log_implausible, log_too_small, possible
from fluxproof.diagnosis.inference.model import Columns
from fluxproof.diagnosis.inference.problem import Problem

LOADED_FROM = (1.5, 3.0)  # times the smallest torque: rows above it are taken as loaded at first


def fit_set(problem: Problem, names) -> FittedSet:
    """The fit of a set of effects on a problem."""
    names, setup = tuple(sorted(names)), problem.setup
    take, value, c, cov, a, lam, mu = setup.call(likelihood, problem, names)
    # Prior odds of every effect, and the prior of its size: even in the logarithm up to a frequent size, and
    # falling beyond.
    value += sum(
        setup.odds(n)
        + log_choice(setup.effects[n], setup.view)
        - np.log(np.log(problem.most[n]))
        - np.log1p((x / problem.often[n]) ** 2)
        for n, x in zip(names, a, strict=True)
    )
    found = FittedSet(problem, names, float(value), take, c, cov, a, lam, mu)
    judged = float(value) + log_implausible(found, names) + log_too_small(found, names)
    return replace(found, value=judged)


def likelihood(problem: Problem, names: tuple):
    """(columns of a sorted set, log evidence without priors, coefficients, covariance, sizes, lambda, mu).

    Of the coefficients that exclude each other, those of the highest evidence that are possible.
    """
    ways = itertools.product(*(problem.ways[name] for name in names))
    found = [_likelihood(problem, names, sum(way, [])) for way in ways]
    return found[0] if len(found) == 1 else max(found, key=lambda f: (_is_possible(problem, names, f), f[1]))


def _is_possible(problem, names, found) -> bool:
    """Whether a result of ``_likelihood`` has no impossible effect, of those whose forms exclude each other."""
    take, value, *rest = found
    fitted = FittedSet(problem, names, value, take, *rest)
    return possible(fitted, [n for n in names if isinstance(problem.setup.effects[n], Alternatives)])


def _likelihood(problem, names, take):
    """``likelihood`` with the columns ``take``."""
    p, common = problem.p, len(problem.common)
    take = np.array(take, np.int64)
    # The common error of the balance is in every set, as an effect of fixed size that nobody names.
    place = {name: n for n, name in enumerate(names)}
    columns = Columns(
        np.concatenate([problem.across[take], problem.common]),
        np.append(problem.prior[take], np.ones(common)),
        np.array([place[problem.keys[n][0]] for n in take] + [len(names)] * common, np.int64),
        np.append(problem.core[take], np.ones(common, bool)),
        np.array([problem.most[n] for n in names] + [1.0], float),
        np.array([problem.formula[n] for n in names] + [0.0]),
    )
    rows, prior = p.rows(), problem.setup.prior(p)
    tried = [evidence(rows, columns, prior, np.inf)]
    drags = p.loads >= 0 and bool(columns.x[:, p.group == p.loads].any())
    if drags and tried[0].strained:  # which rows are loaded depends on which are taken so at first
        tried += [evidence(rows, columns, prior, start) for start in _starts(p)]
    best = max(tried, key=lambda found: found.log_evidence)
    own = slice(len(take))
    return take, best.log_evidence, best.c[own], best.covariance[own, own], best.sizes[:-1], best.lam, best.mu


def _starts(p) -> list[float]:
    """The values of LOADED_FROM that take different rows as loaded; what the same rows begin ends alike."""
    torque = np.abs(p.y[p.group == p.loads])
    lightest = np.min(torque + p.level[p.group == p.loads])
    taken = {tuple(torque > start * lightest): start for start in reversed(LOADED_FROM)}
    return sorted(taken.values())
