# SPDX-License-Identifier: BSD-3-Clause
"""Which blocks share an operating point, and when the flux linkage of such points changed at once."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.ground.arrays import Complex

NEAR = 0.08  # of the highest speed and of rated current: visits that are compared when an instant is searched
LEAST_SHARE = 0.05  # of the square of the flux voltage, in points that are visited before and after an instant


def point_numbers(view, near) -> np.ndarray:
    """(b,) number of the operating point (speed, i_d, i_q) of each block of a view.

    near: difference of the blocks of one point, of the highest speed and of rated current.
    The first block that is far from all known points starts a new one; fixed bins would split some points.
    """
    m, omega, i = view.machine, view.omega.mean(axis=1), view.i.mean(axis=1)
    top = max(float(np.abs(omega).max()), 1e-9)
    points = np.stack([omega / top, i.real / m.rated_current_a, i.imag / m.rated_current_a], axis=1)
    number, free = np.full(len(points), -1), 0
    while (number < 0).any():
        first = points[np.argmax(number < 0)]
        number[(number < 0) & (np.abs(points - first).max(axis=1) < near)] = free
        free += 1
    return number


def instant_of_change(view) -> float | None:
    """Time [s] of the dwell from which on the flux linkage of the d axis has changed most; None: no point repeats.

    Only visits to one operating point are compared with each other, so that an error of the nominal drive that is
    constant over time has no influence.
    """
    return _change(view)[0]


def log_prior(view) -> float:
    """Log of the prior probability of that instant, one of all instants between two dwells."""
    return -float(np.log(max(_change(view)[1], 1)))


def _change(view) -> tuple[float | None, int]:
    """(instant or None, number of instants that were compared), searched once for all views of a recording."""
    if "change" not in view.memo:
        view.memo["change"] = _searched(view)
    return view.memo["change"]


def _searched(view) -> tuple[float | None, int]:
    order = np.argsort(view.t, kind="stable")
    omega = view.omega.mean(axis=1)[order]
    point = point_numbers(view, NEAR)[order]
    count = np.bincount(point)
    u: Complex = misfit(view)["u"]
    change = u.imag.mean(axis=1)[order]
    change = change - (np.bincount(point, change) / count)[point]
    # Of what a step after block n explains: its product with the misfit, and its square less what the means take.
    product = np.cumsum(change[::-1] * omega[::-1])[::-1]
    later, square = np.zeros(len(count)), np.zeros(len(order))
    whole, taken = 0.0, 0.0
    for n in range(len(order) - 1, -1, -1):
        p, w = point[n], omega[n]
        whole += w * w
        taken += ((later[p] + w) ** 2 - later[p] ** 2) / count[p]
        later[p] += w
        square[n] = whole - taken
    # Not within a dwell, whose first or last block may be a transient, and not between two recordings.
    dwell, row = view.run[order], view.rows[order]
    between = np.r_[False, (np.diff(dwell) != 0) & (np.diff(row) > 0)]
    seen = between & (square > LEAST_SHARE * whole)
    if not seen.any():
        return None, 0
    gain = np.where(seen, product**2 / np.maximum(square, 1e-300), -1.0)
    return float(view.t[order][np.argmax(gain)]), int(seen.sum())
