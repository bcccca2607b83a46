# SPDX-License-Identifier: BSD-3-Clause
"""Clipping: runs at exactly the largest or smallest value that the signal enters with a large slope.

The top of a quantised sine is flat too, but its slope there is nearly zero: extrapolated over half the flat with the
mean slope of as many rows before, it gains a few codes.  A clipped signal gains a large part of its amplitude.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.runs import mark, quantum, runs_of_equal
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "channels"
LEAST_CLIPPED = 3  # rows
CODES = 12.0
SHARE = 0.03  # of the channel's range
MOST_RUNS = 5000


def check(recording, nominal) -> None:
    for name in ("i_a", "i_b", "i_c"):
        if name in recording.columns and not recording.slow:
            _check_one(recording, name)


def _check_one(recording, name) -> None:
    x = recording[name]
    high, low = float(x.max()), float(x.min())
    step = quantum(x)
    if high - low < 16 * step or high == low:
        return
    least_gain = max(CODES * step, SHARE * (high - low))
    tops, starts, lengths = 0, [], []
    for top in (high, low):
        first, length = runs_of_equal(x == top, LEAST_CLIPPED)
        at_top = x[first] == top
        first, length = first[at_top], length[at_top]
        found = _clipped(x, first[:MOST_RUNS], length[:MOST_RUNS], least_gain)
        if found:  # then the other flats at this value are clipped too, whatever their slopes
            tops += found
            starts.append(first)
            lengths.append(length)
    if tops < 2:
        return
    first, length = np.concatenate(starts), np.concatenate(lengths)
    count = mark(recording.usable, first, length, 1, 1)
    row = int(first.min())
    message = f"flat at {x[row]:.6g} A in {len(first)} places"
    recording.problems.append(Problem("clipped", message, name, row, count, "rows not used"))


def _clipped(x, first, length, least_gain) -> int:
    """Number of flats whose slopes at both ends would have gained more than ``least_gain``."""
    # Both ends are required: a current that steps up and stays has only one slope.
    before, after = first - 1 - length, first + 2 * length
    inside = (before >= 0) & (after < len(x))
    first, length, before, after = first[inside], length[inside], before[inside], after[inside]
    up = np.abs(x[first - 1] - x[before]) / length
    down = np.abs(x[first + length] - x[after]) / length
    return int(np.count_nonzero(np.minimum(up, down) * length / 2 > least_gain))
