# SPDX-License-Identifier: BSD-3-Clause
"""The best sets before the search around one of them."""

from fluxproof.diagnosis.inference.judged import CLOSE, Judged, Names

ALIKE = 8


def alike(judged: Judged, best: Names):
    """Linearise the best sets: those that are alike before the data are corrected may differ much afterwards."""
    least = judged.best().value - CLOSE
    for fit in judged.ranked()[:ALIKE]:
        if not fit.own and fit.value > least:
            judged.linearise(fit.names)
