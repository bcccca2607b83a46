# SPDX-License-Identifier: BSD-3-Clause
"""Runs of exactly equal values in a channel (not itself a check)."""

from __future__ import annotations

import numpy as np


def runs_of_equal(values, least) -> tuple[np.ndarray, np.ndarray]:
    """(first rows, lengths) of the runs of at least ``least`` equal values, of an array of shape (n,)."""
    change = np.flatnonzero(values[1:] != values[:-1]) + 1
    edges = np.concatenate([[0], change, [len(values)]])
    length = np.diff(edges)
    long = length >= least
    return edges[:-1][long], length[long]


def quantum(values) -> float:
    """The smallest step between distinct values, 0 for a constant; examines up to 20,000 values."""
    start = max(0, len(values) // 2 - 10_000)
    step = np.abs(np.diff(values[start : start + 20_000]))
    step = step[step > 1e-12 * max(1.0, float(np.max(np.abs(values))))]
    return float(step.min()) if len(step) else 0.0


def mark(usable, first, length, before=0, after=0) -> int:
    """Clear ``usable`` on the runs and rows around them; returns the number of rows in the runs."""
    edge = np.zeros(len(usable) + 1, int)
    np.add.at(edge, np.maximum(first - before, 0), 1)
    np.add.at(edge, np.minimum(first + length + after, len(usable)), -1)
    usable &= np.cumsum(edge)[:-1] == 0
    return int(np.sum(length))
