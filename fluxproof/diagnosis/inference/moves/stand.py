# SPDX-License-Identifier: BSD-3-Clause
"""The best set on its own linearisation, until its coefficients stand."""

from fluxproof.diagnosis.inference.judged import CONVERGED, Judged, Names


def stand(judged: Judged, best: Names):
    """Linearise the best set until it stands: its sizes are what is reported."""
    if best:
        judged.linearise(best, CONVERGED)
