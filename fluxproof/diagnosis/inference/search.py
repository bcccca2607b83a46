# SPDX-License-Identifier: BSD-3-Clause
"""The search for probable sets of effects.

1. Judge small sets on the recording as it is, and grow the good ones (moves.FIRST).
2. Judge sets around the best one on its linearisation, until it stays the best (moves.AROUND).
3. Judge it, and what it is compared with, each on its own linearisation, until it stays the best (moves.LAST).
"""

from __future__ import annotations

from types import MappingProxyType

from fluxproof.diagnosis.inference import moves
from fluxproof.diagnosis.inference.judged import MOST_EFFECTS, Judged
from fluxproof.diagnosis.inference.posterior import Posterior
from fluxproof.diagnosis.inference.setup import Setup

ROUNDS = 3  # around the best set


def search(setup: Setup, progress=lambda text: None) -> Posterior:
    """The posterior over sets of all effects; progress: function of a text about what is judged next."""
    judged = Judged(setup)
    judged.judge(judged.first, [(), *((name,) for name in judged.first.able())])
    for move in moves.FIRST:
        move(judged, ())
    until_it_stands(judged, moves.AROUND, ROUNDS, progress)
    until_it_stands(judged, moves.LAST, MOST_EFFECTS)
    return Posterior(setup, MappingProxyType(judged.fits), frozenset(judged.around))


def until_it_stands(judged: Judged, steps, rounds: int, progress=lambda text: None):
    """Apply moves to the best set until it stays the best, at most ``rounds`` times."""
    for _ in range(rounds):
        best = judged.best().names
        progress(f"around {', '.join(best) or 'no effect'}")
        for move in steps:
            move(judged, best)
        if judged.best().names == best:
            return
