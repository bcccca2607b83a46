# SPDX-License-Identifier: BSD-3-Clause
"""Centre-aligned gate signals with dead time: a reference source for the switching plant."""

import numpy as np

from fluxproof.plant.jit import njit


@njit
def centred_gates(duties, dead_time_s, period_s):
    """Edges and gate words of one period: (times (n,) float64 [s], words (n,) int64).

    The period starts in the middle of the lower zero vector.  Every turn-on is
    delayed by dead_time_s, every turn-off is immediate, and a pulse shorter than
    the dead time is dropped; a leg at duty 0 or 1 does not switch.  The
    first edge is at 0 and assumes that the previous period had the same duties.
    """
    times, legs, upper, lower = np.zeros(15), np.zeros(15, np.int64), np.zeros(15), np.zeros(15)
    n = 0
    for k in range(3):
        duty = min(max(duties[k], 0.0), 1.0)
        rise, fall = 0.5 * (1.0 - duty) * period_s, 0.5 * (1.0 + duty) * period_s
        if duty == 0.0 or duty == 1.0:
            legs[n], upper[n], lower[n] = k, duty, 1.0 - duty
            n += 1
            continue
        lower_on = fall + dead_time_s
        wraps = lower_on >= period_s
        legs[n], lower[n] = k, 0.0 if wraps else 1.0
        n += 1
        if wraps and lower_on - period_s < rise:
            times[n], legs[n], lower[n] = lower_on - period_s, k, 1.0
            n += 1
        times[n], legs[n] = rise, k
        n += 1
        if rise + dead_time_s < fall:
            times[n], legs[n], upper[n] = rise + dead_time_s, k, 1.0
            n += 1
        times[n], legs[n] = fall, k
        n += 1
        if not wraps:
            times[n], legs[n], lower[n] = lower_on, k, 1.0
            n += 1
    order = np.argsort(times[:n], kind="mergesort")
    edge_times, words = np.empty(n), np.empty(n, np.int64)
    word = 0
    for j in range(n):
        e = order[j]
        k = legs[e]
        word &= ~((1 << k) | (8 << k))
        word |= (int(upper[e]) << k) | (int(lower[e]) << (k + 3))
        edge_times[j], words[j] = times[e], word
    return edge_times, words


RISING, FALLING = 1, -1  # half of a carrier period: from the valley to the peak, from the peak to the valley


@njit
def half_gates(duties, half, levels, waits, dead_time_s, half_s):
    """Edges and gate words of half a period with duties of its own: (times (n,) float64 [s], words (n,) int64).

    half: RISING, a leg goes high for the last part ``duty``; FALLING, it is high for the first.  At the extreme
    between two halves a leg changes only if one of them asks for duty 0 or 1.  Every change turns both gates of the leg
    off and the other one on dead_time_s later.  levels, waits: (3,) float64, command of each leg and the rest of a dead
    time [s] at the start; both are advanced in place.  Gates off before: levels 0 and waits dead_time_s.
    """
    times, legs, upper, lower = np.zeros(18), np.zeros(18, np.int64), np.zeros(18), np.zeros(18)
    n = 0
    for k in range(3):
        duty = min(max(duties[k], 0.0), 1.0)
        whole = duty == 0.0 or duty == 1.0
        first = duty if whole else (0.0 if half == RISING else 1.0)
        change = (1.0 - duty if half == RISING else duty) * half_s
        for step in range(1 if whole else 2):
            at, level = (0.0, first) if step == 0 else (change, 1.0 - first)
            if step == 0 and waits[k] > 0.0:  # a dead time goes on: both gates are off
                times[n], legs[n] = 0.0, k
                n += 1
            elif step == 1 and 0.0 < waits[k] < at:  # it ends before the next change
                times[n], legs[n], upper[n], lower[n] = waits[k], k, levels[k], 1.0 - levels[k]
                n += 1
                waits[k] = 0.0
            if level != levels[k]:
                times[n], legs[n] = at, k
                n += 1
                levels[k], waits[k] = level, at + dead_time_s
            if waits[k] <= at:
                times[n], legs[n], upper[n], lower[n] = at, k, levels[k], 1.0 - levels[k]
                waits[k] = 0.0
                n += 1
        if 0.0 < waits[k] < half_s:
            times[n], legs[n], upper[n], lower[n] = waits[k], k, levels[k], 1.0 - levels[k]
            n += 1
            waits[k] = 0.0
        waits[k] = max(0.0, waits[k] - half_s)
    order = np.argsort(times[:n], kind="mergesort")
    edge_times, words = np.empty(n), np.empty(n, np.int64)
    word = 0
    for j in range(n):
        e = order[j]
        k = legs[e]
        word &= ~((1 << k) | (8 << k))
        word |= (int(upper[e]) << k) | (int(lower[e]) << (k + 3))
        edge_times[j], words[j] = times[e], word
    return edge_times, words
