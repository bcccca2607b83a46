# SPDX-License-Identifier: BSD-3-Clause
"""What is found and too small to act on: it is a note, makes no verdict and hides no cause beside it.

Significant is not relevant: with enough rows an offset of a thousandth of the rated current is certain, and of interest
to nobody.  Each effect declares the smallest size that an engineer would act on (``relevant``).
"""

from __future__ import annotations

from dataclasses import replace

from fluxproof.diagnosis.ground import constants as k


def relevant_names(names, best):
    """Names without effects that are too small to act on, which become ``minor``; best: the most probable set.

    An alternative is too small where sets that explain the same with nothing that is large enough to act on are not
    improbable: two causes that all but cancel stood beside a bus voltage that is off by 0.05 %.
    """
    groups = tuple(g for g in names.ambiguous if _is_acted_on(g, names.fits))
    dropped = {n for g in set(names.ambiguous) - set(groups) for n in g if n in best.names}
    minor = {n: p for n, p in names.named.items() if is_minor(best, n)}
    named = {n: p for n, p in names.named.items() if n not in minor}
    probable = {n: sum(p for p, fit in names.fits if n in fit.names) for n in dropped}
    return replace(names, named=named, ambiguous=groups, minor=minor | probable)


def _is_acted_on(group, kept) -> bool:
    """Whether an effect of a group is there and large enough to act on, in all but improbable sets.

    An effect that is in none of the sets, as a factor that no voltage tells from another, has no size that speaks
    against it.
    """
    with_one = [(p, fit, set(group) & set(fit.names)) for p, fit in kept]
    large = sum(p for p, fit, mine in with_one if any(not is_minor(fit, n) for n in mine))
    return large >= (1.0 - k.DOUBTED) * sum(p for p, _, mine in with_one if mine)


def is_minor(fit, name) -> bool:
    """Whether an effect of a set is too small to act on."""
    effect, nominal = fit.problem.setup.effects[name], fit.problem.view.nominal
    return effect.size(fit.c[name], nominal) < effect.relevant(nominal)
