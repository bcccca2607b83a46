# SPDX-License-Identifier: BSD-3-Clause
"""What is found and too small to act on: it is a note, makes no verdict and hides no cause beside it.

Significant is not relevant: with enough rows an offset of a thousandth of the rated current is certain, and of interest
to nobody.  Each effect declares the smallest size that an engineer would act on (``relevant``).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.ground import constants as k


def relevant_names(names, best):
    """Names without effects that are too small to act on, which become ``minor``; best: the most probable set.

    An ambiguity counts where its effects are probably large enough to act on; else its members are notes.
    """
    groups = tuple(g for g in names.ambiguous if _is_acted_on(g, names.fits))
    dropped = {n for g in set(names.ambiguous) - set(groups) for n in g if n in best.names}
    minor = {n: p for n, p in names.named.items() if is_minor(best, n)}
    named = {n: p for n, p in names.named.items() if n not in minor}
    probable = {n: sum(p for p, fit in names.fits if n in fit.names) for n in dropped}
    return replace(names, named=named, ambiguous=groups, minor=minor | probable)


def _is_acted_on(group, kept) -> bool:
    """Whether effects of a group are probably large enough to act on, where any of them is there.

    A group that is in none of the sets, as a factor that no voltage tells from another, has no size that speaks
    against it.
    """
    there = [(p, fit, mine) for p, fit in kept if (mine := set(group) & set(fit.names))]
    large = sum(p for p, fit, mine in there if _is_large(fit, mine))
    return not there or large > k.ACTED_ON * sum(p for p, _, _ in there)


def _is_large(fit, mine) -> bool:
    """Whether one of the effects of a set would be worth acting on if it did alone what they do along its rows.

    Two that share a misfit may be small alone, two that cancel may be large, and two small ones that have nothing to do
    with each other stay small: a delay beside a twist of the shaft, 0.6 and 0.85 of what counts.
    """
    setup, nominal = fit.problem.setup, fit.problem.view.nominal
    rows = setup.cells.ok

    def explained(names) -> np.ndarray:
        return ((fit.problem.y - fit.left(names)) / setup.usual)[rows]

    together = explained(mine)
    for name in mine:
        effect, alone = setup.effects[name], explained((name,))
        times = effect.size(fit.c[name], nominal) / effect.relevant(nominal)
        if (together @ alone) * times >= alone @ alone:
            return True
    return False


def is_minor(fit, name) -> bool:
    """Whether an effect of a set is too small to act on."""
    effect, nominal = fit.problem.setup.effects[name], fit.problem.view.nominal
    return effect.size(fit.c[name], nominal) < effect.relevant(nominal)
