# SPDX-License-Identifier: BSD-3-Clause
"""The best single effects, each on its own linearisation."""

from fluxproof.diagnosis.inference.judged import Judged, Names

LEADERS = 3


def leaders(judged: Judged, best: Names):
    """Linearise the best single effects alone."""
    for fit in judged.ranked(lambda f: len(f.names) == 1)[:LEADERS]:
        if not fit.own:
            judged.linearise(fit.names)
