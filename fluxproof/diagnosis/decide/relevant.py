# SPDX-License-Identifier: BSD-3-Clause
"""What is found and too small to act on: it is a note, makes no verdict and hides no cause beside it.

Significant is not relevant: with enough rows an offset of a thousandth of the rated current is certain, and of interest
to nobody.  Each effect declares the smallest size that an engineer would act on (``relevant``).
"""

from __future__ import annotations

from dataclasses import replace


def relevant_names(names, best):
    """Names without effects that are too small to act on, which become ``minor``; best: the most probable set.

    An alternative is too small if all of its effects are, each in the most probable set that contains it.
    """
    fits = [fit for _, fit in names.fits]
    groups = tuple(g for g in names.ambiguous if any(not is_minor(_first(fits, n), n) for n in g))
    dropped = {n for g in set(names.ambiguous) - set(groups) for n in g if n in best.names}
    minor = {n: p for n, p in names.named.items() if is_minor(best, n)}
    named = {n: p for n, p in names.named.items() if n not in minor}
    probable = {n: sum(p for p, fit in names.fits if n in fit.names) for n in dropped}
    return replace(names, named=named, ambiguous=groups, minor=minor | probable)


def is_minor(fit, name) -> bool:
    """Whether an effect of a set is too small to act on."""
    if fit is None:
        return False
    effect, nominal = fit.problem.setup.effects[name], fit.problem.view.nominal
    return effect.size(fit.c[name], nominal) < effect.relevant(nominal)


def _first(fits, name):
    """The most probable set with an effect, or None."""
    return next((fit for fit in fits if name in fit.names), None)
