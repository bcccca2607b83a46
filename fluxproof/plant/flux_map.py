# SPDX-License-Identifier: BSD-3-Clause
"""Gridded flux maps: psi_d(i_d, i_q), psi_q(i_d, i_q) and their inverse.

Interpolation is bicubic (Catmull-Rom): it passes through the grid points and
has continuous first derivatives, so the incremental inductances do not jump at
cell borders and Newton's method inverts the map in a few steps.  Outside the
grid the map is extrapolated linearly with the slope at the border.
"""

from dataclasses import dataclass

import numpy as np

from fluxproof.plant.jit import njit


@dataclass(frozen=True, eq=False)
class FluxMap:
    """Flux linkage on a regular grid of dq currents.

    i_d_a: shape (n,), i_q_a: shape (m,), equally spaced and rising [A].
    psi_d_wb, psi_q_wb: shape (n, m), magnet flux included [Wb].
    """

    i_d_a: np.ndarray
    i_q_a: np.ndarray
    psi_d_wb: np.ndarray
    psi_q_wb: np.ndarray

    def __post_init__(self):
        for axis in (self.i_d_a, self.i_q_a):
            step = np.diff(axis)
            if len(axis) < 3 or step[0] <= 0 or not np.allclose(step, step[0], rtol=1e-6):
                raise ValueError("flux map: currents must rise in equal steps, three or more")
        shape = (len(self.i_d_a), len(self.i_q_a))
        if self.psi_d_wb.shape != shape or self.psi_q_wb.shape != shape:
            raise ValueError(f"flux map: flux arrays must have the shape {shape}")

    @classmethod
    def from_points(cls, i_d, i_q, psi_d, psi_q):
        """Build from four columns listing every grid point once, in any order."""
        axis_d, at_d = np.unique(np.asarray(i_d, float), return_inverse=True)
        axis_q, at_q = np.unique(np.asarray(i_q, float), return_inverse=True)
        if len(i_d) != len(axis_d) * len(axis_q):
            raise ValueError("flux map: the points do not fill a grid")
        grids = []
        for column in (psi_d, psi_q):
            grid = np.full((len(axis_d), len(axis_q)), np.nan)
            grid[at_d, at_q] = column
            grids.append(grid)
        if np.isnan(grids).any():
            raise ValueError("flux map: a grid point is missing or not a number")
        return cls(axis_d, axis_q, *grids)

    def folds(self):
        """Number of points, of a grid twice as fine, at which the map has no unique inverse.

        There an incremental inductance is not positive: impossible in a passive
        machine, possible in a noisy measurement.
        """
        table, axes = self.table(), self.axes()
        count = 0
        for i_d in np.linspace(self.i_d_a[0], self.i_d_a[-1], 2 * len(self.i_d_a) - 1):
            for i_q in np.linspace(self.i_q_a[0], self.i_q_a[-1], 2 * len(self.i_q_a) - 1):
                _, _, dd, dq, qd, qq = map_flux(table, axes, i_d, i_q)
                count += dd <= 0.0 or qq <= 0.0 or dd * qq - dq * qd <= 0.0
        return count

    def mended(self, floor=0.2):
        """Return the nearest map whose flux rises along its own axis, line by line.

        Least squares under the condition that every step rises by at least
        floor x the median step.  Lines that fulfil the condition are unchanged.
        """
        return FluxMap(self.i_d_a, self.i_q_a, _rising(self.psi_d_wb.T, floor).T, _rising(self.psi_q_wb, floor))

    def axes(self):
        """Return [i_d start, i_d step, i_q start, i_q step] in A, float64 (4,)."""
        first, second = self.i_d_a, self.i_q_a
        return np.array(
            [
                first[0],
                (first[-1] - first[0]) / (len(first) - 1),
                second[0],
                (second[-1] - second[0]) / (len(second) - 1),
            ]
        )

    def table(self):
        """Return both maps with a linearly extrapolated border, (2, n+2, m+2).

        The border provides the outer support points of the cubic.
        """
        padded = [np.pad(g, 1, mode="reflect", reflect_type="odd") for g in (self.psi_d_wb, self.psi_q_wb)]
        return np.ascontiguousarray(padded, dtype=float)


def _rising(lines, floor):
    """Isotonic regression of every row, with a least step of floor x the median one."""
    from scipy.optimize import isotonic_regression  # takes 0.7 s of all commands, most of which have no map

    ramp = floor * np.median(np.diff(lines, axis=1)) * np.arange(lines.shape[1])
    rising = np.array([isotonic_regression(line - ramp).x + ramp for line in lines])
    untouched = np.abs(rising - lines) < 1e-12 * np.abs(lines).max()
    return np.where(untouched, lines, rising)


@njit
def _locate(x, start, step, count):
    """Cell index, position within it, and how far x lies outside the grid."""
    last = start + step * (count - 1)
    inside = min(max(x, start), last)
    position = (inside - start) / step
    cell = min(int(position), count - 2)
    return cell, position - cell, x - inside


@njit
def _weights(t):
    """Catmull-Rom weights of the four support points at t in [0, 1]."""
    t2, t3 = t * t, t * t * t
    return (
        0.5 * (-t + 2.0 * t2 - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    )


@njit
def _slopes(t):
    """Derivatives of the weights with respect to t."""
    t2 = t * t
    return (
        0.5 * (-1.0 + 4.0 * t - 3.0 * t2),
        0.5 * (-10.0 * t + 9.0 * t2),
        0.5 * (1.0 + 8.0 * t - 9.0 * t2),
        0.5 * (3.0 * t2 - 2.0 * t),
    )


@njit
def map_flux(table, axes, i_d, i_q):
    """Interpolate: (psi_d, psi_q, dpsi_d/di_d, dpsi_d/di_q, dpsi_q/di_d, dpsi_q/di_q)."""
    row, t, out_d = _locate(i_d, axes[0], axes[1], table.shape[1] - 2)
    col, s, out_q = _locate(i_q, axes[2], axes[3], table.shape[2] - 2)
    w_d, w_q = _weights(t), _weights(s)
    g_d, g_q = _slopes(t), _slopes(s)
    psi_d = psi_q = dd = dq = qd = qq = 0.0
    for j in range(4):
        d0 = d1 = q0 = q1 = 0.0
        for k in range(4):
            value_d = table[0, row + j, col + k]
            value_q = table[1, row + j, col + k]
            d0 += w_q[k] * value_d
            d1 += g_q[k] * value_d
            q0 += w_q[k] * value_q
            q1 += g_q[k] * value_q
        psi_d += w_d[j] * d0
        psi_q += w_d[j] * q0
        dd += g_d[j] * d0
        qd += g_d[j] * q0
        dq += w_d[j] * d1
        qq += w_d[j] * q1
    dd, qd = dd / axes[1], qd / axes[1]
    dq, qq = dq / axes[3], qq / axes[3]
    psi_d += dd * out_d + dq * out_q
    psi_q += qd * out_d + qq * out_q
    return psi_d, psi_q, dd, dq, qd, qq


@njit
def map_currents(table, axes, psi_d, psi_q, guess_d, guess_q):
    """Invert the map by Newton from a guess (the last currents); returns (i_d, i_q) in A.

    The first steps are limited to five cells: a distant guess may be in the
    saturated region, where the slope overshoots the solution.
    """
    i_d, i_q = guess_d, guess_q
    for _ in range(60):
        f_d, f_q, dd, dq, qd, qq = map_flux(table, axes, i_d, i_q)
        e_d, e_q = psi_d - f_d, psi_q - f_q
        det = dd * qq - dq * qd
        step_d = (qq * e_d - dq * e_q) / det
        step_q = (dd * e_q - qd * e_d) / det
        longest = max(abs(step_d) / axes[1], abs(step_q) / axes[3])
        if longest > 5.0:
            step_d, step_q = step_d * 5.0 / longest, step_q * 5.0 / longest
        i_d += step_d
        i_q += step_q
        if longest < 1e-11:
            break
    return i_d, i_q
