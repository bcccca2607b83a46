# SPDX-License-Identifier: BSD-3-Clause
"""The best set of every smaller number of effects, on its own linearisation."""

import numpy as np

from fluxproof.diagnosis.inference.judged import CONVERGED, Judged, Names


def simpler(judged: Judged, best: Names):
    """Linearise the best set of every smaller number of effects.

    An offset beside a resistance that is half wrong, say: on the linearisation of a larger set, which found other
    causes for what is not linear, the true pair may be far worse than it is.
    """
    for size in range(1, len(best)):
        for fit in judged.ranked(lambda f, size=size: len(f.names) == size)[:1]:
            if not fit.own and np.isfinite(fit.value):
                judged.linearise(fit.names, CONVERGED)
