# SPDX-License-Identifier: BSD-3-Clause
"""Sets that differ from the best one by an effect or two, on its linearisation."""

import itertools

from fluxproof.diagnosis.inference.converge import around
from fluxproof.diagnosis.inference.judged import MOST_EFFECTS, Judged, Names
from fluxproof.diagnosis.inference.problem import Problem


def neighbours(judged: Judged, best: Names):
    """Linearise at the best set, and judge it and the sets near it there.

    A slow log of an EMRAX 228 whose angle is off by half a radian, with a voltage that is 14 % too large and 8 % more
    magnet flux: without it a quarter of the probability lies with other sets.
    """
    problem = around(judged.setup, judged.fits[best])
    if problem is not None:
        judged.judge(problem, [best], own=True)
        judged.judge(problem, near(judged, problem, best))


def near(judged: Judged, problem: Problem, names: Names) -> list[Names]:
    """Sets with one effect less, more or another one than ``names``; two for one, and one for two."""
    able = [n for n in problem.able() if n not in names]
    less = [tuple(n for n in names if n != out) for out in names]
    more = [(*names, n) for n in able]
    swapped = [(*rest, n) for rest in less for n in able]
    rests = itertools.combinations(names, len(names) - 2) if len(names) > 1 else ()
    fewer = [(*rest, n) for rest in rests for n in able]
    two = [(*names, *pair) for pair in itertools.combinations(able, 2)] if len(names) <= 1 else []
    return [*less, *(m for m in more if len(m) <= MOST_EFFECTS), *swapped, *fewer, *two]
