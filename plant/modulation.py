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
