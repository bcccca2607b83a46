# SPDX-License-Identifier: BSD-3-Clause
"""A search over effects whose log evidence stands in a table: what it finds depends on its moves alone."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from fluxproof.diagnosis.effects import Effect, FarStart, MeasurementError
from fluxproof.diagnosis.inference.fit import likelihood
from fluxproof.diagnosis.inference.fitted_set import FittedSet
from fluxproof.diagnosis.inference.linearise import linearised
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.search import search

POOR = -1000.0  # log evidence of a set of which the table says nothing
ERRORS = "ef"  # effects that are measurement errors


def _effect(corrects, starts) -> Effect:
    """An effect that is never impossible; corrects: a measurement error; starts: it is approached from these."""
    parts = [part for part, mine in ((MeasurementError, corrects), (FarStart, bool(starts))) if mine] or [Effect]
    possible = {"too_large": lambda self, c, view: False, "possible": lambda self, c, covariance, nominal: True}
    of_floor = {"size": lambda self, c, nominal: 1.0, "floor": lambda self, nominal: 1.0, "plausible": {}}
    return object.__new__(type("Lettered", tuple(parts), {"starts": starts, **possible, **of_floor}))


class Table:
    """{(set, linearised at): log evidence}, both as the letters of their effects; "" is the recording as it is.

    Of a set without an entry for its own linearisation, that of the recording counts.  coefficient: of a fit at a
    point with that coefficient.  starts: coefficients from which the effect "e" is approached, its evidence for each
    of them in the table as ("e", coefficient).
    """

    def __init__(self, table, effects="abcdefgh", coefficient=lambda x: 1.0, starts=()):
        self.table, self.effects, self.coefficient = {("", ""): 0.0} | table, effects, coefficient
        own = {n: tuple({"x": x} for x in starts) if n == "e" else () for n in effects}
        self.setup = SimpleNamespace(
            call=self._call,
            odds=lambda name: 0.0,
            rows=None,
            effects={n: _effect(n in ERRORS, own[n]) for n in effects},
            view=SimpleNamespace(u=np.ones((1, 3)), to_dq=lambda u: u),  # a voltage of 1 V, all of which is misfit
            cells=SimpleNamespace(channel=np.array(["u"]), order=np.zeros(1), y=np.ones(1)),
        )

    def _call(self, step, *arguments):
        if step is linearised:
            return {name: dict(own)["x"] for name, own in arguments[1]}  # {effect: coefficient} of the point
        if step is Problem:
            return _Problem(self, arguments[1] if len(arguments) > 1 else {})
        if step is likelihood:
            return arguments[0].likelihood(arguments[1])
        return step(*arguments)

    def evidence(self, names, at) -> float:
        """Log evidence of a set on the linearisation at {effect: coefficient}."""
        for place in (tuple(at.values())[0] if len(at) == 1 else None, "".join(sorted(at)), ""):
            if (names, place) in self.table:
                return self.table[names, place]
        return POOR

    def found(self) -> FittedSet:
        """The best set of the search."""
        return search(self.setup).best()


class _Problem:
    """The linear problem at {effect: coefficient}."""

    def __init__(self, table, at):
        self.setup, self.table, self.at = table.setup, table, at
        self.keys = [(n, "x") for n in table.effects]
        self.coefficients = {n: ["x"] for n in table.effects}
        self.view, self.p = SimpleNamespace(nominal=None), SimpleNamespace(y=np.zeros(8))
        self.most, self.often = dict.fromkeys(table.effects, np.e), dict.fromkeys(table.effects, np.inf)  # no prior

    def able(self):
        """All effects."""
        return list(self.table.effects)

    def likelihood(self, names):
        """What ``likelihood`` finds of a set, with its value of the table."""
        take = np.array([self.table.effects.index(n) for n in names], int)
        vector = np.array([self.table.coefficient(self.at.get(n, 2.0)) for n in names])
        value = self.table.evidence("".join(names), self.at)
        one = np.ones(len(names))
        return take, value, vector, 1e-4 * np.diag(one), one, np.zeros(1), np.zeros(1)
