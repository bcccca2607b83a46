# SPDX-License-Identifier: BSD-3-Clause
"""The linear problem of one view: columns of all effects as means of operating points, and their priors.

A set of effects is first judged on the view as recorded.  Measurement errors (angle, currents, timing, bus) act on the
data; around a solution the data are corrected for them, the columns are computed again, and what was corrected is added
back to first order, so that the same problem serves every set.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.effects import Alternatives
from fluxproof.diagnosis.effects.constant import is_exact
from fluxproof.diagnosis.effects.free_curve import alternatives
from fluxproof.diagnosis.effects.search import log_choice
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.inference.evidence import evidence
from fluxproof.diagnosis.inference.fitted_set import FittedSet, implausible, log_too_small, possible
from fluxproof.diagnosis.inference.linearise import Linearisation
from fluxproof.diagnosis.inference.model import Columns
from fluxproof.diagnosis.inference.points import condense
from fluxproof.diagnosis.inference.setup import Setup, repeated

LOADED_FROM = (1.5, 3.0)  # times the smallest torque: rows above it are taken as loaded at first


class Problem:
    """Columns and misfit at one linearisation; totals: {effect: {coefficient: value}} of its measurement errors."""

    def __init__(self, setup: Setup, at: Linearisation | None = None):
        """at: the linearisation (None: the recording as it is)."""
        if at is None:
            nothing = np.zeros(len(setup.cells.y))
            at = Linearisation(setup.view, setup.cells, {}, nothing, nothing, None)
        self.setup, self.view, self.totals, doubt = setup, at.view, at.totals, at.doubt
        self.cells = cells = at.cells
        change = at.change + repeated(at.ripple, setup)
        y = setup.cells.y + change
        for name, c in self.totals.items():
            columns = cells.columns[name]
            for key, value in c.items():
                column = columns.get(key)
                if value and column is not None:
                    y = y + value * column
        self.y = y
        self.keys = [(name, key) for name, columns in cells.columns.items() for key in columns]
        self.coefficients = {name: list(columns) for name, columns in cells.columns.items()}
        stack = [cells.columns[n][key] for n, key in self.keys]
        x = np.array(stack).T if stack else np.zeros((len(y), 0))
        if doubt is not None:
            doubt = np.where(cells.channel == "u", doubt[cells.block], 0.0)
        x = np.column_stack([x, setup.common])
        self.p = condense(setup.grouping, y, x, setup.noise, setup.level, setup.load, doubt)
        self.p.x, self.common = self.p.x[:, : len(self.keys)], self.p.x[:, len(self.keys) :]
        self._priors()

    def _priors(self):
        p, nominal = self.p, self.view.nominal
        length = np.sqrt(np.mean((p.x / p.level[:, None]) ** 2, axis=0)) if len(p.y) else np.zeros(p.x.shape[1])
        self.prior, self.most, self.often = np.zeros(len(self.keys)), {}, {}
        self.index = {}
        for name in self.cells.columns:
            effect = self.setup.effects[name]
            mine = [n for n, (owner, _) in enumerate(self.keys) if owner == name]
            cores = [n for n in mine if self.keys[n] not in self.cells.free and length[n] > 1e-9]
            floor = effect.floor(nominal)
            zero = {self.keys[n][1]: 0.0 for n in mine}
            for n in cores:
                unit = effect.size({**zero, self.keys[n][1]: 1.0}, nominal)
                self.prior[n] = floor / max(unit, 1e-30)
            curves = [n for n in mine if self.keys[n] in self.cells.free and length[n] > 1e-9]
            scales = {self.keys[n][1]: self.prior[n] for n in cores}
            for n in curves if cores else []:
                self.prior[n] = effect.curve * effect.curve_scale(self.keys[n][1], scales, nominal)
            ceiling = effect.ceiling(nominal)
            self.most[name] = max(min(ceiling / floor, k.WIDEST), 2.0) if np.isfinite(ceiling) else k.UNBOUNDED
            often = effect.often(nominal)
            self.often[name] = float(np.sqrt(self.most[name])) if often is None else often / floor
            self.index[name] = cores + [n for n in curves if self.prior[n] > 0.0] if cores else []

    def condensed(self, rows):
        """(n,) means and contrasts of further rows (r,)."""
        return self.p.condensed(rows)

    def able(self):
        """Effects that have a column in this problem."""
        return [n for n, mine in self.index.items() if mine]

    def likelihood(self, names: tuple):
        """(columns of a sorted set, log evidence without priors, coefficients, covariance, sizes, lambda, mu).

        Of the coefficients that exclude each other, those of the highest evidence that are possible.
        """
        ways = itertools.product(*(self._ways(name) for name in names))
        found = [self._likelihood(names, sum(way, [])) for way in ways]
        return found[0] if len(found) == 1 else max(found, key=lambda f: (self._is_possible(names, f), f[1]))

    def _is_possible(self, names, found) -> bool:
        """Whether a result of ``_likelihood`` has no impossible effect, of those whose forms exclude each other."""
        take, value, *rest = found
        fit = FittedSet(self, names, value, take, *rest)
        return possible(fit, [n for n in names if isinstance(self.setup.effects[n], Alternatives)])

    def _ways(self, name) -> list[list[int]]:
        """The columns of an effect, once with each group of those that exclude each other."""
        one_of = alternatives(self.setup.effects[name])
        group = {n: [g for g in one_of if self.keys[n][1] in g] for n in self.index[name]}
        seen = [g for g in one_of if [g] in group.values()]
        return [[n for n, mine in group.items() if not mine or mine == [kept]] for kept in seen or (None,)]

    def _likelihood(self, names, mine):
        """``likelihood`` with the columns ``mine``."""
        p, take, common = self.p, np.array(mine, np.int64), self.common.shape[1]
        # The common error of the balance is in every set, as an effect of fixed size that nobody names.
        owner = np.array([names.index(self.keys[n][0]) for n in mine] + [len(names)] * common, np.int64)
        most = np.array([self.most[n] for n in names] + [1.0], float)
        scale = np.append(self.prior[take], np.ones(common))
        x = np.column_stack([p.x[:, take], self.common])
        # Where no formula is preferred (a curve of 1), the free columns tell the size too.
        tells = lambda key: key not in self.cells.free or self.setup.effects[key[0]].curve >= 1.0  # noqa: E731
        core = np.array([tells(self.keys[n]) for n in mine] + [True] * common, bool)
        formula = np.array([0.0 if is_exact(self.setup.effects[n]) else k.FORMULA for n in names] + [0.0])
        drags = p.loads >= 0 and bool(x[p.group == p.loads].any())
        columns, rows, prior = Columns(x, scale, owner, core, most, formula), p.rows(), self.setup.prior(p)
        tried = [evidence(rows, columns, prior, np.inf)]
        if drags and tried[0].strained:  # which rows are loaded depends on which are taken so at first
            tried += [evidence(rows, columns, prior, start) for start in LOADED_FROM]
        best = max(tried, key=lambda found: found.log_evidence)
        own = slice(len(take))
        return take, best.log_evidence, best.c[own], best.covariance[own, own], best.sizes[:-1], best.lam, best.mu

    def fit(self, names) -> FittedSet:
        """The fit of a set of effects on this problem."""
        names = tuple(sorted(names))
        take, value, c, cov, a, lam, mu = self.setup.call(Problem.likelihood, self, names)
        # Prior odds of every effect, and the prior of its size: even in the logarithm up to a frequent size, and
        # falling beyond.
        value += sum(
            self.setup.odds(n)
            + log_choice(self.setup.effects[n], self.setup.view)
            - np.log(np.log(self.most[n]))
            - np.log1p((x / self.often[n]) ** 2)
            for n, x in zip(names, a, strict=True)
        )
        found = FittedSet(self, names, float(value), take, c, cov, a, lam, mu)
        judged = float(value) + np.log(k.IMPLAUSIBLE) * implausible(found) + log_too_small(found, names)
        return replace(found, value=judged)
