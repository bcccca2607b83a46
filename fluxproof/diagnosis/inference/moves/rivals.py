# SPDX-License-Identifier: BSD-3-Clause
"""The best set that lacks an effect of the best one, on its own linearisation."""

from fluxproof.diagnosis.inference.judged import CONVERGED, Judged, Names

RIVAL = 50.0  # log evidence below the best from which a set that does not stand may still reach it


def rivals(judged: Judged, best: Names):
    """Linearise, for each effect of the best set, the best set without it: only then is it known what it adds."""
    for out in best:
        for fit in judged.ranked(lambda f, out=out: out not in f.names)[:1]:
            if not fit.stands and fit.value > judged.best().value - RIVAL:
                judged.linearise(fit.names, CONVERGED)
