# SPDX-License-Identifier: BSD-3-Clause
"""The best set without one of its effects, on its own linearisation."""

import numpy as np

from fluxproof.diagnosis.inference.judged import CONVERGED, Judged, Names


def parts(judged: Judged, best: Names):
    """Linearise the best set without each of its effects.

    A part that is impossible on the linearisation of another set may be possible on its own.
    """
    for out in best:
        part = tuple(n for n in best if n != out)
        fit = judged.fits.get(part)
        if fit is not None and not fit.stands and (not fit.own or np.isfinite(fit.value)):
            judged.linearise(part, CONVERGED)
