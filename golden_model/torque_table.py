# SPDX-License-Identifier: BSD-3-Clause
"""The table of reference_table, computed offline: least current for a torque and a flux limit (docs/speed_range.md).

Any machine whose flux linkage is a function of i_d and i_q >= 0: surface, interior, reluctance, by constant
inductances or by a measured map.  For each flux limit and each torque, of all points that give the torque within the
current circle and the flux limit, the one of least current: MTPA, current circle, voltage circle and MTPV need no
cases.  Peak values, amplitude-invariant frames.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from golden_model.control.reference_table import ADDRESS as ADDRESS_BIT
from golden_model.control.reference_table import COLUMNS, ROWS, SELECT, SIZE, WORDS, WRITE
from golden_model.formats import PU

Flux = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  # (i_d, i_q) [A] -> (lambda_d, lambda_q) [Wb]
GRID_D, GRID_Q = 801, 401  # points over the current circle


@dataclass(frozen=True)
class TorqueTable:
    """i_d, i_q (ROWS, COLUMNS) [A] and top (ROWS,) [Nm] over flux limits (ROWS,) [Wb]."""

    i_d_a: np.ndarray
    i_q_a: np.ndarray
    top_nm: np.ndarray
    flux_wb: np.ndarray

    def words(self, bases, torque_nm: float) -> np.ndarray:
        """(2, SIZE) integers of the RAM; ``torque_nm``: the torque of 1.0 per unit."""
        words = np.zeros((2, SIZE), np.int64)
        rows = words.reshape(2, ROWS, WORDS)
        rows[0, :, :COLUMNS] = np.round(self.i_d_a / bases.current_a / PU.lsb)
        rows[1, :, :COLUMNS] = np.floor(self.i_q_a / bases.current_a / PU.lsb)
        rows[0, :, COLUMNS] = np.floor(self.top_nm / torque_nm / PU.lsb)
        return np.clip(words, PU.lo, PU.hi)


def linear(machine) -> Flux:
    """The flux linkage by constant inductances."""
    return lambda i_d, i_q: (machine.magnet_flux_wb + machine.inductance_d_h * i_d, machine.inductance_q_h * i_q)


def measured(i_d, i_q, psi_d, psi_q) -> Flux:
    """The flux linkage by a map of rising currents (n,), (m,) and fluxes (n, m), bilinear, symmetrical in i_q."""
    axis_d, axis_q = np.asarray(i_d, float), np.asarray(i_q, float)
    grids = [np.asarray(psi_d, float), np.asarray(psi_q, float)]
    if axis_q[0] < 0.0:  # both signs measured: the mean of the two
        grids = [(grids[0] + grids[0][:, ::-1]) / 2.0, (grids[1] - grids[1][:, ::-1]) / 2.0]

    def flux(x, y):
        u = np.clip(np.interp(x, axis_d, np.arange(len(axis_d))), 0, len(axis_d) - 1 - 1e-9)
        v = np.clip(np.interp(y, axis_q, np.arange(len(axis_q))), 0, len(axis_q) - 1 - 1e-9)
        k, n = u.astype(int), v.astype(int)
        a, b = u - k, v - n
        return tuple(
            (1 - a) * ((1 - b) * g[k, n] + b * g[k, n + 1]) + a * ((1 - b) * g[k + 1, n] + b * g[k + 1, n + 1])
            for g in grids
        )

    return flux


class Plane:
    """Torque [Nm], flux magnitude [Wb] and current [A] over a grid of the current circle's half i_q >= 0."""

    def __init__(self, flux: Flux, pole_pairs: int, i_max: float):
        self.i_d = np.linspace(-i_max, i_max, GRID_D)
        self.i_q_end = np.sqrt(np.maximum(i_max**2 - self.i_d**2, 0.0))
        self.part = np.linspace(0.0, 1.0, GRID_Q)  # of the way to the circle
        self.i_q = self.i_q_end[:, None] * self.part
        d, q = flux(np.broadcast_to(self.i_d[:, None], self.i_q.shape), self.i_q)
        self.torque = 1.5 * pole_pairs * (d * self.i_q - q * self.i_d[:, None])
        self.flux = np.hypot(d, q)

    def _at(self, grid, part):
        """Values of a grid at a part of the way for each i_d, linear between its points."""
        x = part * (GRID_Q - 1)
        k = np.minimum(x.astype(int), GRID_Q - 2)
        rows = np.arange(GRID_D)
        return grid[rows, k] + (x - k) * (grid[rows, k + 1] - grid[rows, k])

    def _first(self, grid, level):
        """The part of the way where each i_d's values first reach the level; infinite where they do not."""
        above = grid >= level
        k = above.argmax(axis=1)
        rows, before = np.arange(GRID_D), np.maximum(k - 1, 0)
        low, high = grid[rows, before], grid[rows, k]
        inside = np.where(high > low, (level - low) / np.where(high > low, high - low, 1.0), 1.0)
        part = np.where(k > 0, before + np.clip(inside, 0.0, 1.0), 0.0) / (GRID_Q - 1)
        return np.where(above.any(axis=1), part, np.inf)

    def most(self, flux_wb: float) -> tuple[float, float, float]:
        """(torque, i_d, i_q) of the largest torque within the flux limit; without one, the least flux at i_q = 0."""
        idle = self.flux[:, 0] <= flux_wb
        if not idle.any():
            k = int(self.flux[:, 0].argmin())
            return 0.0, float(self.i_d[k]), 0.0
        reach = np.minimum(self._first(self.flux, flux_wb), 1.0)
        allowed = np.where(self.part <= reach[:, None], self.torque, -np.inf)
        inner = allowed.argmax(axis=1)
        at_limit = self._at(self.torque, reach)
        best = np.where(idle, np.maximum(at_limit, allowed.max(axis=1)), -np.inf)
        k = int(best.argmax())
        part = reach[k] if at_limit[k] >= allowed[k].max() else self.part[inner[k]]
        return max(float(best[k]), 0.0), float(self.i_d[k]), float(self.i_q_end[k] * part)

    def least_current(self, torque: float, flux_wb: float) -> tuple[float, float] | None:
        """(i_d, i_q) of the least current that gives the torque within the flux limit; None if nothing does."""
        part = self._first(self.torque, torque)
        reached = np.isfinite(part)
        part = np.where(reached, part, 1.0)
        fits = reached & (self._at(self.flux, part) <= flux_wb)
        if not fits.any():
            return None
        i_q = self.i_q_end * part
        size = np.where(fits, np.hypot(self.i_d, i_q), np.inf)
        k = int(size.argmin())
        i_d, least_q = float(self.i_d[k]), float(i_q[k])
        # The border of the flux limit lies between two points of the grid: half way by interpolation of the flux.
        towards = k + (1 if self.i_d[k] < 0.0 else -1)
        if 0 <= towards < GRID_D and reached[towards] and not fits[towards]:
            inside, outside = self._at(self.flux, part)[k], self._at(self.flux, part)[towards]
            f = float(np.clip((flux_wb - inside) / (outside - inside), 0.0, 1.0))
            i_d, least_q = i_d + f * (self.i_d[towards] - i_d), least_q + f * (i_q[towards] - least_q)
        elif 0 < k < GRID_D - 1 and fits[k - 1] and fits[k + 1]:  # the vertex of a parabola through three points
            a, b, c = size[k - 1 : k + 2]
            f = 0.5 * (a - c) / (a - 2 * b + c) if a - 2 * b + c > 0.0 else 0.0
            n = k + (1 if f > 0 else -1)
            i_d, least_q = i_d + abs(f) * (self.i_d[n] - i_d), least_q + abs(f) * (i_q[n] - least_q)
        return i_d, least_q


def build(flux: Flux, pole_pairs: int, i_max: float) -> TorqueTable:
    """The table of a machine; the last row's flux limit is the flux of the largest torque within the circle."""
    plane = Plane(flux, pole_pairs, i_max)
    free = plane.most(np.inf)
    d, q = flux(np.array([free[1]]), np.array([free[2]]))
    limits = float(np.hypot(d, q)[0]) * np.arange(ROWS) / (ROWS - 1)
    i_d, i_q, top = np.zeros((ROWS, COLUMNS)), np.zeros((ROWS, COLUMNS)), np.zeros(ROWS)
    for row, limit in enumerate(limits):
        top[row], end_d, end_q = plane.most(limit * (1.0 + 1e-9))
        for column in range(COLUMNS):
            t = column / (COLUMNS - 1)
            found = plane.least_current(t * top[row], limit * (1.0 + 1e-9)) if column < COLUMNS - 1 else None
            if found is None:
                found = (end_d, end_q if top[row] > 0.0 and column else 0.0)
            i_d[row, column], i_q[row, column] = found
    return TorqueTable(i_d, i_q, top, limits)


def table_words(words: np.ndarray) -> list[int]:
    """The values of the register table_word that load the RAM, then zero."""
    out = []
    for axis, select in enumerate((0, SELECT)):
        out += [
            WRITE | select | (address << ADDRESS_BIT) | (int(v) & ((1 << PU.width) - 1))
            for address, v in enumerate(words[axis])
        ]
    return [*out, 0]
