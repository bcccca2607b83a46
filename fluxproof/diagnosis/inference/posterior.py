# SPDX-License-Identifier: BSD-3-Clause
"""The posterior over sets of effects, as the search leaves it: read-only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.inference.fitted_set import FittedSet
from fluxproof.diagnosis.inference.setup import Setup


@dataclass(frozen=True, eq=False)
class Posterior:
    """All sets that were judged, the best linearisation of each.

    around: sets of measurement errors around whose best set others were judged; agrees: whether the misfit may be no
    more than a recording of this kind has, so that there may be no cause.
    """

    setup: Setup
    fits: Mapping[tuple[str, ...], FittedSet]
    around: frozenset[frozenset[str]] = frozenset()
    agrees: bool = True

    def best(self) -> FittedSet:
        """The most probable set."""
        return max(self.fits.values(), key=lambda f: f.value)

    def weights(self) -> list[tuple[float, FittedSet]]:
        """[(probability, set)] of all sets, the most probable first; where there is a cause, of those with one."""
        fits = [f for f in self.fits.values() if f.names or self.agrees] or list(self.fits.values())
        fits = sorted(fits, key=lambda f: -f.value)
        w = np.exp(np.array([f.value for f in fits]) - fits[0].value)
        return list(zip(w / w.sum(), fits, strict=True))

    def present(self) -> dict[str, float]:
        """{effect: probability of being present}."""
        out: dict[str, float] = {}
        for p, fit in self.weights():
            for n in fit.names:
                out[n] = out.get(n, 0.0) + float(p)
        return out
