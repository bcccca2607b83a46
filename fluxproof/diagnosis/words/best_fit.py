# SPDX-License-Identifier: BSD-3-Clause
"""The sentence on the causes that fit an unexplained misfit best, and on what was found and is too small to act on."""

from __future__ import annotations

from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.words.phrases import capital, joined, percent_below, said, title_of

SOME = 2  # effects that the short headline names


def best_fits(answer, effects) -> list[str]:
    """'encoder offset (offset 0.48 rad) fits best (43 %), but it leaves 60 % of the misfit', the longest first."""
    best = answer.best_fit
    if best is None:
        return []
    titles = [title_of(e.name, effects) for e in best.effects]
    few = titles if len(titles) <= SOME else [*titles[:SOME], f"{len(titles) - SOME} more"]
    sized = [joined([said(e, effects, most, brackets=True) for e in best.effects]) for most in (None, 1)]
    p = f"probability {percent_below(best.probability)}" if best.probability >= 0.005 else "probability below 1 %"
    texts = [*sized, joined(titles), joined(few)]
    return [f"{text} {'fit' if len(titles) > 1 else 'fits'} best ({p}), but {best.against}" for text in texts]


def minor_notes(found, effects) -> list[str]:
    """Notes on what was found and is too small to act on."""
    return [f"{capital(said(e, effects, brackets=True))}: found, but too small to act on." for e in found]


def left_by_best(answer) -> str:
    """'It leaves 1.2 V at held-out operating points.' of the best fit."""
    return f"The best fit leaves {ascii_of(quantity(answer.best_fit.left, answer.fit.unit, 3))} there."
