# SPDX-License-Identifier: BSD-3-Clause
"""Messages of a slow log: how often a signal is updated, seen from its changes.

A log on a bus holds every value until the next message, or interpolates between two messages.
"""

from __future__ import annotations

import numpy as np

REST = 1e-3  # of a signal's largest value: a smaller signal is at rest and needs no update
RESTED = 6.0  # times the median time between changes: after a longer time the signal counts as constant
EVERY_ROW = 0.75  # of the rows: between every one, and every second one, which a held or interpolated signal changes in
USUAL = 0.9  # quantile of the other intervals
GAP = 10.0  # times the usual step


def updates(x) -> np.ndarray:
    """(n,) number of rows up to each one in which a signal changed, or is at rest and needs no update."""
    return np.cumsum(np.append(False, np.diff(x) != 0) | (np.abs(x) < REST * np.nanmax(np.abs(x))))


def message_period(t, x) -> float:
    """Typical longest time between two messages of a signal [s], from its changes; interpolation counts once.

    Of a signal that changes in nearly every row, each row is a message: its few longer intervals are rests.
    """
    apart = _between_changes(t, x) if np.isfinite(x).any() and not _is_in_every_row(x) else ()
    if len(apart) < 4:
        return float(np.median(np.diff(t)))
    return float(np.quantile(apart[apart < RESTED * np.median(apart)], USUAL))


def _is_in_every_row(x) -> bool:
    """Whether a signal, where it is not at rest, neither holds a value nor is interpolated over two rows or more."""
    largest = np.nanmax(np.abs(x))
    active = np.abs(x) > REST * largest
    moves, bends = (np.abs(np.diff(x, n)) > 1e-9 * largest for n in (1, 2))
    return bool(active[2:].any() and min(moves[active[1:]].mean(), bends[active[2:]].mean()) > EVERY_ROW)


def restless(t, x) -> bool:
    """Whether a signal changes with nearly every message unless at rest, so that no change means no message."""
    if not np.isfinite(x).any():  # not recorded
        return False
    apart, period = _between_changes(t, x), message_period(t, x)
    active = np.abs(x) > REST * np.nanmax(np.abs(x))
    return float(apart[apart < 3.0 * period].sum()) > 0.5 * active.mean() * (t[-1] - t[0])


def _between_changes(t, x) -> np.ndarray:
    bends = np.flatnonzero(np.abs(np.diff(x, 2)) > 1e-9 * max(np.nanmax(np.abs(x)), 1e-30)) + 1
    step = np.median(np.diff(t))
    over = np.append(0, np.cumsum(np.diff(t) > GAP * step))
    apart = np.diff(t[bends])[np.diff(over[bends]) == 0]  # rows that were not recorded are no wait for a message
    return apart[apart > 1.5 * step]
