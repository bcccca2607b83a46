# SPDX-License-Identifier: BSD-3-Clause
"""Ratio of the angle's advance to that of the speed, which reveals wrong units and signs (not itself a check).

    ratio = sum(dtheta omega T) / sum((omega T)^2)

over consecutive rows, with the steps of the angle wrapped into (-pi, pi].  It is 1 if angle and speed agree.
"""

from __future__ import annotations

import numpy as np

MOST_ROWS = 100_000
LEAST_TURN = 1.0  # rad in total; below it the noise of the angle dominates


def wrapped(angle):
    """The angle [rad] wrapped into (-pi, pi]."""
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


def angle_speed_ratio(recording, period, theta_factor=1.0, omega_factor=1.0) -> float | None:
    """The ratio for rows ``period`` [s] apart; None if angle, speed or rotation is missing.

    None also if the angle advances by more than a third of a turn per row: it is then aliased.
    """
    if not recording.has("theta_e", "omega_e") or len(recording) < 3:
        return None
    rows = _rows(recording)
    if not len(rows):  # no two usable rows follow each other, as with a value missing in every second row
        return None
    theta, omega = recording["theta_e"] * theta_factor, recording["omega_e"] * omega_factor
    advance = 0.5 * (omega[rows] + omega[rows + 1]) * period
    turned = wrapped(theta[rows + 1] - theta[rows])
    fast = np.abs(advance) > 0.3 * np.percentile(np.abs(advance), 95)
    advance, turned = advance[fast], turned[fast]
    if not len(advance) or np.sum(np.abs(advance)) < LEAST_TURN or np.percentile(np.abs(advance), 95) > 2.0:
        return None
    if np.median(np.abs(turned)) > 2.0:
        return None
    keep = slice(None)
    for _ in range(3):  # rows in which one of the two is stuck must not count
        ratio = float(np.sum((turned * advance)[keep]) / np.sum((advance * advance)[keep]))
        off = np.abs(turned - ratio * advance)
        keep = off <= 4.0 * np.median(off) + 1e-12
    scatter = float(np.median(np.abs(turned - ratio * advance)))
    # Angles that jump at random have no ratio, not a small one.
    return ratio if scatter < 0.5 * float(np.median(np.abs(turned))) + 1e-12 else None


def _rows(recording) -> np.ndarray:
    """At most MOST_ROWS rows with the usual time step, spread over the recording."""
    step = np.diff(recording["t"])
    usual = np.median(step[step > 0]) if np.any(step > 0) else 0.0
    rows = np.flatnonzero((step > 0.5 * usual) & (step < 1.5 * usual) & recording.usable[1:] & recording.usable[:-1])
    return rows[:: max(1, len(rows) // MOST_ROWS)]
