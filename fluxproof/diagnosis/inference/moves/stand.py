# SPDX-License-Identifier: BSD-3-Clause
"""The best set on its own linearisation, until its coefficients stand."""

from fluxproof.diagnosis.inference.judged import CONVERGED, Judged, Names

MOST = 24  # sets that lose their lead by it, one after another


def stand(judged: Judged, best: Names):
    """Linearise the best set until it stands: its sizes are what is reported.

    One that loses by it was good on a linearisation only which its own sizes contradict, and so may be the next: an
    angle that twists with the torque, beside a strong saturation, led in a dozen sets and was possible in none.
    """
    for _ in range(MOST):
        if not best or judged.fits[best].stands:
            return
        judged.linearise(best, CONVERGED)
        best, before = judged.best().names, best
        if best == before:
            return
