# SPDX-License-Identifier: BSD-3-Clause
"""Good sets with one effect more, up to the largest number of effects."""

import numpy as np

from fluxproof.diagnosis.inference.judged import MOST_EFFECTS, Judged, Names

KEPT = (12, 80)  # least and most sets of one size that are grown further
EFFORT = 20000  # rows times sets of one size
GROWN = 3  # effects up to which sets are grown where rows are many


def grow(judged: Judged, best: Names):
    """Add every effect to the good sets of each size: two causes of which neither is good alone.

    Pairs are always judged.  A size of which no set is the best so far is not grown further: with one cause or none,
    and these are most recordings, larger sets only cost time.
    """
    able = judged.first.able()
    wide = int(np.clip(EFFORT / max(len(judged.first.p.y), 1), *KEPT))
    for size in range(2, (MOST_EFFECTS if wide == KEPT[1] else GROWN) + 1):
        good = judged.ranked(lambda f, less=size - 1: len(f.names) == less)
        if size > 2 and (not good or good[0].value < judged.best().value):
            return
        good = good[: len(able) if size == 2 else wide]
        judged.judge(judged.first, {tuple(sorted({*f.names, n})) for f in good for n in able if n not in f.names})
