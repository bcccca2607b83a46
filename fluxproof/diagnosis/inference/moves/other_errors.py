# SPDX-License-Identifier: BSD-3-Clause
"""Close sets that correct other measurement errors than the best one, each on its own linearisation."""

from fluxproof.diagnosis.inference.judged import CLOSE, Judged, Names

TRIED = 8


def other_errors(judged: Judged, best: Names):
    """Linearise close sets with other measurement errors: on data that are corrected otherwise they look worse.

    A slow log of an EMRAX 228 whose angle is off by half a radian, with a voltage that is 14 % too large and 8 % more
    magnet flux: without it a sixth of the probability lies with other sets.
    """
    mine = judged.errors(best)
    for _ in range(TRIED):
        least = judged.best().value - CLOSE
        close = judged.ranked(lambda f, least=least: not f.own and f.value > least and judged.errors(f.names) != mine)
        if not close:
            return
        judged.linearise(close[0].names)
