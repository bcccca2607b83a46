# SPDX-License-Identifier: BSD-3-Clause
"""Currents that are wrong at high duty: a shunt below a leg carries its current only while the low switch is on.

Above some duty the window is too short to sample, and the three currents no longer sum to what they usually do.  The
current of that leg then follows from the other two, which were sampled in the same period.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "channels"
PHASES, DUTIES = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c")
HIGH = 0.8  # least duty at which a window may be too short
LEAST = 20  # rows
CLEAR, LEAST_SUM = 8.0, 0.02  # of the usual sum of the currents; of rated current
MARGIN = 0.005  # below that duty, in which rows are corrected too: nothing is lost by it
WRONG, STRAY = 0.7, 0.01  # share of the rows above the duty whose sum is off; of those below


def check(recording, nominal) -> None:
    if recording.slow or recording.points or not recording.has(*PHASES, *DUTIES):
        return
    delay = nominal.control.duty_applied_after_samples
    currents = np.stack([recording[name] for name in PHASES])
    total, good = currents.sum(axis=0), recording.usable.copy()
    found = None
    for before in (delay, delay + 1):  # sampled in the period that ends with the row, or in that which begins
        duties = np.roll(np.stack([recording[name] for name in DUTIES]), before, axis=1)
        good[:before] = False
        seen = _limit(total, duties.max(axis=0), good, nominal.machine.rated_current_a)
        if seen is not None and (found is None or seen[0] > found[0]):
            found = *seen, duties
    if found is None:
        return
    _, limit, duties = found
    blind = (duties > limit - MARGIN) & good
    one = blind.sum(axis=0) == 1
    usual = float(np.median(total[good & ~blind.any(axis=0)]))
    for name, current, rows in zip(PHASES, currents, blind & one, strict=True):
        recording.columns[name] = np.where(rows, usual - (total - current), current)
    recording.usable &= blind.sum(axis=0) < 2
    row, count = int(np.argmax(blind.any(axis=0))), int(blind.any(axis=0).sum())
    message = (
        f"in {counted(count, 'row')} with a duty above {limit:.3g} the current of that leg is wrong, as if its shunt "
        "had no time to be sampled"
    )
    action = "computed from the other two; rows with two such legs are not used"
    recording.problems.append(Problem("shunt_window", message, "i_a", row, count, action))


def _limit(total, highest, good, rated) -> tuple[float, float] | None:
    """(how well it separates, the duty above which the sum of the currents (n,) is off); None without one."""
    low = good & (highest <= HIGH)
    if low.sum() < LEAST:
        return None
    usual = float(np.median(total[low]))
    spread = 1.5 * float(np.median(np.abs(total[low] - usual)))
    off = good & (np.abs(total - usual) > max(CLEAR * spread, LEAST_SUM * rated))
    at_high = off & (highest > HIGH)
    if at_high.sum() < LEAST:
        return None
    limit = float(np.quantile(highest[at_high], STRAY))
    above, below = float(np.mean(off[good & (highest > limit)])), float(np.mean(off[good & (highest <= limit)]))
    return (above - below, limit) if above > WRONG and below < STRAY else None
