# SPDX-License-Identifier: BSD-3-Clause
"""Weighted least squares over cells: how well a set of effects explains a misfit, and with which coefficients.

A model is a set of effects, each in its core or its free form.  Its score is chi^2 plus a penalty for every
coefficient (Schwarz's criterion, BIC) and for every effect; lower is better.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

from fluxproof.diagnosis.ground import constants

FRESH = 0.06  # least share of a column that is independent of the earlier ones; else it is rejected as collinear


@numba.njit(cache=True)
def _explained(gram, right, index, fresh2):
    """Power explained by the columns in their order, and the columns that are kept (not collinear with earlier ones).

    A Cholesky factorisation that skips a column whose pivot falls below ``fresh2`` of its power.
    """
    n = len(index)
    factor, z = np.zeros((n, n)), np.zeros(n)
    columns, kept = np.zeros(n, np.int64), np.zeros(n, np.bool_)
    gain, count = 0.0, 0
    for a in range(n):
        row = np.zeros(n)
        pivot, value = gram[index[a], index[a]], right[index[a]]
        for b in range(count):
            x = gram[index[a], columns[b]]
            for c in range(b):
                x -= row[c] * factor[b, c]
            row[b] = x / factor[b, b]
            pivot -= row[b] * row[b]
            value -= row[b] * z[b]
        if pivot > fresh2:
            row[count] = np.sqrt(pivot)
            z[count] = value / row[count]
            for b in range(count + 1):  # numba compiles a loop in a tenth of what an assignment of arrays takes
                factor[count, b] = row[b]
            columns[count], kept[a] = index[a], True
            gain += z[count] ** 2
            count += 1
    return gain, kept


@dataclass(frozen=True)
class Model:
    """Names of the effects, and those of them in their free form."""

    names: frozenset
    free: frozenset = frozenset()

    def __len__(self):
        return len(self.names)

    def without(self, name):
        return Model(self.names - {name}, self.free - {name})

    def with_(self, name, free=False):
        return Model(self.names | {name}, self.free | {name} if free else self.free - {name})


@dataclass
class Solution:
    """Coefficients {effect: {coefficient: value}} of a model, their covariance, chi^2 and degrees of freedom."""

    model: Model
    chi2: float
    count: int  # coefficients
    rows: int
    c: dict = field(default_factory=dict)
    covariance: dict = field(default_factory=dict)  # {effect: (k, k)}
    score: float = np.inf
    residual: np.ndarray | None = None


class Fitter:
    """The weighted problem of one view; ``train``: (r,) bool, rows used for the fit."""

    def __init__(self, cells, sigma, train):
        self.cells, self.sigma = cells, sigma
        self.use = cells.ok & train
        self.names, self.owner, stack = [], [], []
        for effect, columns in cells.columns.items():
            for key, column in columns.items():
                self.names.append(key)
                self.owner.append(effect)
                stack.append(column[self.use] / sigma[self.use])
        self.y = cells.y[self.use] / sigma[self.use]
        a = np.array(stack).T if stack else np.zeros((len(self.y), 0))
        self.scale = np.linalg.norm(a, axis=0)
        self.scale[self.scale < 1e-9] = np.inf
        self.a = a / self.scale
        self.gram, self.right, self.power = self.a.T @ self.a, self.a.T @ self.y, float(self.y @ self.y)
        self.penalty = float(np.log(max(len(self.y), 10)))
        self.index = {effect: ([], []) for effect in cells.columns}  # includes effects without columns
        for k, (effect, key) in enumerate(zip(self.owner, self.names, strict=True)):
            core, free = self.index[effect]
            if np.isfinite(self.scale[k]):
                (free if (effect, key) in cells.free else core).append(k)

    def columns_of(self, model) -> np.ndarray:
        """Indices of a model's columns, the cores first."""
        names = sorted(model.names)
        cores = [k for name in names for k in self.index[name][0]]
        return np.array(cores + [k for name in names if name in model.free for k in self.index[name][1]], np.int64)

    def carried(self, model) -> np.ndarray:
        """Indices of a model's columns that the data determine.

        Two current levels determine one coefficient of a curve; a second one would be fitted to the noise of the
        current around the levels.
        """
        index = self.columns_of(model)
        return index[_explained(self.gram, self.right, index, FRESH**2)[1]]

    def chi2(self, model) -> tuple[float, int]:
        """chi^2 and the number of coefficients, from the Gram matrix alone."""
        gain, kept = _explained(self.gram, self.right, self.columns_of(model), FRESH**2)
        return max(self.power - gain, 0.0), int(kept.sum())

    def score(self, model) -> float:
        """chi^2 plus the penalty of coefficients and effects."""
        chi2, count = self.chi2(model)
        return chi2 + self.penalty * count + constants.PER_EFFECT * len(model)

    def solve(self, model) -> Solution:
        """Coefficients, covariance, residual and score of a model."""
        out = self.unscored(model)
        out.score = self.score(model)
        return out

    def unscored(self, model) -> Solution:
        """The solution without its score; coefficients that the data do not determine are zero."""
        index, carried = self.columns_of(model), self.carried(model)
        inverse = np.linalg.inv(self.gram[np.ix_(carried, carried)])
        chi2, count = self.chi2(model)
        out = Solution(model, chi2, count, len(self.y))
        at = np.searchsorted(index, carried, sorter=np.argsort(index))
        at = np.argsort(index)[at]
        values, covariance = np.zeros(len(index)), np.zeros((len(index),) * 2)
        values[at] = inverse @ self.right[carried] / self.scale[carried]
        covariance[np.ix_(at, at)] = inverse / np.outer(self.scale[carried], self.scale[carried])
        fitted = np.zeros(len(self.cells.y))
        for k, value in zip(index, values, strict=True):
            fitted += value * self.cells.columns[self.owner[k]][self.names[k]]
        for name in sorted(model.names):
            mine = [n for n, k in enumerate(index) if self.owner[k] == name]
            out.c[name] = {self.names[index[n]]: float(values[n]) for n in mine}
            out.covariance[name] = covariance[np.ix_(mine, mine)]
        out.residual = self.cells.y - fitted
        return out


def everything(cells) -> Model:
    """All effects in their free form."""
    return Model(frozenset(cells.columns), frozenset(cells.columns))
