# SPDX-License-Identifier: BSD-3-Clause
"""The sets that a search has judged so far: what its moves (inference/moves/) read and add to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cached_property

import numpy as np

from fluxproof.diagnosis.effects import MeasurementError
from fluxproof.diagnosis.inference.converge import converged
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import FittedSet, possible
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.setup import Setup

Names = tuple[str, ...]
MOST_EFFECTS = 6
CLOSE = 20.0  # log evidence below the best within which linearising a set on its own is worth the effort
CONVERGED = 12  # most linearisations of a set that has to stand


def of_posterior(fit: FittedSet) -> float:
    """What a possible set is ranked by: its log posterior."""
    return fit.value


class Judged:
    """{names: set}, each in its best linearisation.

    around: sets of measurement errors around whose best set others were judged; worth: what a possible set is ranked
    by.
    """

    def __init__(self, setup: Setup, worth: Callable[[FittedSet], float] = of_posterior):
        self.setup, self.worth = setup, worth
        self.fits: dict[Names, FittedSet] = {}
        self.around: set[frozenset[str]] = set()

    @cached_property
    def first(self) -> Problem:
        """The problem of the recording as it is."""
        return self.setup.call(Problem, self.setup)

    def best(self) -> FittedSet:
        """The best set."""
        return max(self.fits.values(), key=lambda f: f.value)

    def ranked(self, of: Callable[[FittedSet], bool] = lambda fit: True) -> list[FittedSet]:
        """The sets with a property, the best first."""
        return sorted(filter(of, self.fits.values()), key=lambda f: -f.value)

    def errors(self, names: Names) -> frozenset[str]:
        """The measurement errors of a set, which are removed from the data: what is far from linear."""
        return frozenset(n for n in names if isinstance(self.setup.effects[n], MeasurementError))

    def judge(self, problem: Problem, sets: Iterable[Names], own=False):
        """Judge sets on a problem, but none that was judged on its own; own: it was linearised for these sets."""
        for names in (tuple(sorted(names)) for names in sets):
            known = self.fits.get(names)
            fresh = own or known is None or not known.own
            if fresh:
                self._keep(fit_set(problem, names), own)

    def linearise(self, names: Names, steps=3):
        """Judge a set on its own linearisation."""
        stood = max((f.value for f in self.fits.values() if f.stands), default=-np.inf)
        found = converged(self.setup, self.fits[names], steps, stood - CLOSE)
        if found is None:
            self.fits[names] = replace(self.fits[names], value=-np.inf, own=True)
        else:
            self._keep(found, True)

    def _keep(self, fit, own):
        self.fits[fit.names] = replace(fit, value=self.worth(fit) if possible(fit) else -np.inf, own=own)
