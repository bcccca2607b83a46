# SPDX-License-Identifier: BSD-3-Clause
"""The linear problem of one view: columns of all effects as means of operating points, and their priors.

A set of effects is first judged on the view as recorded.  Measurement errors (angle, currents, timing, bus) act on the
data; around a solution the data are corrected for them, the columns are computed again, and what was corrected is added
back to first order, so that the same problem serves every set.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.effects.constant import is_exact
from fluxproof.diagnosis.effects.free_curve import alternatives
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.inference.linearise import Linearisation
from fluxproof.diagnosis.inference.points import condense
from fluxproof.diagnosis.inference.setup import Setup, repeated


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
        self.across = np.ascontiguousarray(self.p.x.T)  # (keys, n): columns of a set are copied in one piece each
        self.common = self.across[len(self.keys) :]
        self.p.x = self.p.x[:, : len(self.keys)]
        self._priors()

    def _priors(self):
        """What is known of the columns before a fit, and {effect: its columns, once with each form of it}."""
        p, nominal = self.p, self.view.nominal
        length = np.sqrt(np.mean((p.x / p.level[:, None]) ** 2, axis=0)) if len(p.y) else np.zeros(p.x.shape[1])
        self.prior, self.most, self.often = np.zeros(len(self.keys)), {}, {}
        self.core, self.formula, self.ways = np.zeros(len(self.keys), bool), {}, {}
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
            # Where no formula is preferred (a curve of 1), the free columns tell the size too.
            self.core[mine] = [self.keys[n] not in self.cells.free or effect.curve >= 1.0 for n in mine]
            self.formula[name] = 0.0 if is_exact(effect) else k.FORMULA
            used = cores + [n for n in curves if self.prior[n] > 0.0] if cores else []
            self.ways[name] = _ways(used, [self.keys[n][1] for n in used], alternatives(effect))

    def condensed(self, rows):
        """(n,) means and contrasts of further rows (r,)."""
        return self.p.condensed(rows)

    def able(self):
        """Effects that have a column in this problem."""
        return [n for n, ways in self.ways.items() if any(ways)]


def _ways(columns, coefficients, one_of) -> list[list[int]]:
    """The columns of an effect, once with each group of ``one_of``, the coefficients that exclude each other."""
    group = {n: [g for g in one_of if key in g] for n, key in zip(columns, coefficients, strict=True)}
    seen = [g for g in one_of if [g] in group.values()]
    return [[n for n, mine in group.items() if not mine or mine == [kept]] for kept in seen or (None,)]
