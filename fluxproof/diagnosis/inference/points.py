# SPDX-License-Identifier: BSD-3-Clause
"""The rows of a balance, condensed: one mean per functional and operating point, and what differs between visits to it.

A *functional* is one harmonic of one channel in one axis.  What no model has (the *discrepancy*) repeats in every
block of an operating point, noise does not: a long dwell is one observation of the physics instead of hundreds.  The
blocks of an operating point are therefore condensed to *visits*, stretches of neighbouring blocks, and these to one
mean and to contrasts, each visit against the mean of the earlier ones.  Means and contrasts have independent noise and
the variance

    v = s^2 + (lambda l)^2

with l the error of the balance at that point and lambda learnt, for means and contrasts of each channel and absolute
order by itself.  The contrasts carry the drifts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.machine import rated_torque
from fluxproof.diagnosis.inference.model import BalanceRows


@dataclass
class Points:
    """y (n,), x (n, columns): means and contrasts.

    s2, level, doubt: (n,) variance of the noise, error of the balance, error of curves.
    group: (n,) int, index into ``groups``: [(channel, absolute order, whether contrasts)]; order, part, point: (n,).
    loads: index of the group whose rows contain a load that nobody recorded, or -1; load: its scale [Nm].
    """

    y: np.ndarray
    x: np.ndarray
    s2: np.ndarray
    level: np.ndarray
    doubt: np.ndarray
    group: np.ndarray
    groups: list
    order: np.ndarray
    part: np.ndarray
    point: np.ndarray
    loads: int
    load: float
    condensed: Callable[[np.ndarray], np.ndarray]  # function of further rows (r,): their means and contrasts (n,)

    def rows(self, y: np.ndarray | None = None, scale: np.ndarray | float = 1.0) -> BalanceRows:
        """The rows of the balance, with another misfit y (n,) and all errors times ``scale``, (n,) or 1."""
        y = self.y if y is None else y
        variance, error, curve_error = self.s2 * scale**2, self.level * scale, self.doubt * scale
        groups, load = len(self.groups), float(self.load)
        return BalanceRows(y, variance, error, curve_error, self.group, groups, self.loads, load)


def balance_level(view, cells):
    """(r,) error of the balance in every row, in the unit of its channel."""
    m = view.machine
    ripple = np.where(cells.order == 0, 1.0, k.BALANCE_ORDER)
    level = ripple * view.balance_error()[cells.block]
    level = np.where(cells.channel == "torque", ripple * k.BALANCE_TORQUE * rated_torque(view.machine), level)
    return np.where(cells.channel == "sum", k.BALANCE_SUM * m.rated_current_a, level)


def visits(view, points) -> np.ndarray:
    """(b,) number of the visit of each block: neighbours in time at one operating point, of limited length."""
    longest = max(1, -(-len(view) // k.VISITS))
    out, number, length = np.zeros(len(view), int), 0, 0
    for n in range(len(view)):
        length += 1
        if n and (view.run[n] != view.run[n - 1] or points[n] != points[n - 1] or length > longest):
            number, length = number + 1, 1
        out[n] = number
    return out


def repeated_dwells(point, dwell) -> np.ndarray:
    """(points,) whether all dwells of a point have an earlier point too; point, dwell: (b,) numbers of the blocks."""
    out, seen = np.zeros(point.max(initial=-1) + 1, bool), set()
    for p in range(len(out)):
        mine = set(dwell[point == p].tolist())
        out[p] = bool(mine) and mine <= seen
        seen |= mine
    return out


class Grouping:
    """Which rows of the fit make which mean or contrast; the same for every linearisation of a recording."""

    def __init__(self, cells, point, visit, use, dwell):
        """point, visit, dwell: (b,) numbers of the blocks; use: (r,) bool, rows of the fit."""
        self.rows = rows = np.flatnonzero(use)
        self.channels, channel = np.unique(cells.channel[rows], return_inverse=True)
        order = np.round(cells.order[rows] * 1e6).astype(np.int64)
        block = cells.block[rows]
        keys = np.stack([channel, order, cells.part[rows], point[block], visit[block]], axis=1)
        self.names, cell = np.unique(keys, axis=0, return_inverse=True)
        self.cell = cell.ravel()
        self.sort = np.argsort(self.cell, kind="stable")
        self.starts = np.searchsorted(self.cell[self.sort], np.arange(len(self.names)))
        # Visits of the same functional and point are neighbours: each against the mean of the earlier ones.
        first = np.ones(len(self.names), bool)
        first[1:] = (self.names[1:, :4] != self.names[:-1, :4]).any(axis=1)
        self.place, self.begin, self.contrast = np.cumsum(first) - 1, np.flatnonzero(first), ~first
        kinds = np.stack([self.names[:, 0], np.abs(self.names[:, 1]), self.contrast], axis=1)
        kinds, group = np.unique(kinds, axis=0, return_inverse=True)
        self.repeated = repeated_dwells(point, dwell)[self.names[:, 3]]
        self.groups = [(str(self.channels[c]), float(o) * 1e-6, bool(d)) for c, o, d in kinds]
        self.group = group.ravel()


def _earlier(values, begin) -> np.ndarray:
    """(n, ...) sums of the earlier values since the last row of ``begin``, (m,) first rows.

    Not as a difference of sums over all rows: weights of other channels, 1e30 times as large, would cancel these.
    """
    out, end = np.zeros_like(values), np.append(begin[1:], len(values))
    rows = begin + 1
    while (more := rows < end).any():
        rows, end = rows[more], end[more]
        out[rows] = out[rows - 1] + values[rows - 1]
        rows = rows + 1
    return out


def condense(grouping, y, x, sigma, level, load=0.0, doubt=None) -> Points:
    """Points of the rows of a grouping.

    y: (r,); x: (r, columns); sigma, level: (r,), noise of a block and error of the balance; load: scale [Nm] of a load
    that nobody recorded, 0: none is possible; doubt: (r,) error of the effects' curves, None: none.
    """
    g = grouping
    rows, sort, starts, begin, place, contrast = g.rows, g.sort, g.starts, g.begin, g.place, g.contrast
    n = len(g.names)
    w = 1.0 / sigma[rows] ** 2
    total = np.bincount(g.cell, w, n)
    earlier = _earlier(total, begin)

    def condensed(values):
        """(n, k) means and contrasts of (r, k) values, and the visits' own means."""
        mean = np.add.reduceat(w[sort, None] * values[rows][sort], starts, axis=0) / total[:, None]
        before = _earlier(total[:, None] * mean, begin)
        out = np.zeros_like(mean)
        out[contrast] = mean[contrast] - before[contrast] / earlier[contrast, None]
        out[begin] = np.add.reduceat(total[:, None] * mean, begin, axis=0) / np.add.reduceat(total, begin)[:, None]
        return out, mean

    out, _ = condensed(np.column_stack([y, x]))
    _, levels = condensed(np.stack([level, np.zeros_like(level) if doubt is None else doubt], axis=1))
    s2, widen = np.zeros(n), np.ones(n)
    s2[contrast] = 1.0 / total[contrast] + 1.0 / earlier[contrast]
    s2[begin] = 1.0 / np.add.reduceat(total, begin)
    widen[contrast] = np.sqrt(1.0 + 1.0 / (np.arange(n) - begin[place])[contrast])
    levels *= widen[:, None]
    groups, group = g.groups, g.group
    loads = groups.index(("torque", 0.0, False)) if load and ("torque", 0.0, False) in groups else -1
    keep = np.ones(n, bool)
    if loads >= 0:  # a dwell has one load, of which a second point would be a second witness
        keep = ~(g.repeated & (group == loads))
    if load and ("torque", 0.0, True) in groups:  # a load may change between visits
        keep &= group != groups.index(("torque", 0.0, True))
    return Points(
        out[keep, 0],
        out[keep, 1:],
        s2[keep],
        levels[keep, 0],
        levels[keep, 1],
        group[keep],
        groups,
        g.names[keep, 1] * 1e-6,
        g.names[keep, 2],
        g.names[keep, 3],
        loads,
        load,
        lambda values: condensed(values[:, None])[0][keep, 0],
    )
