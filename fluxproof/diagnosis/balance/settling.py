# SPDX-License-Identifier: BSD-3-Clause
"""Excludes the start of a recording in which the drive is still settling.

A recording often starts with the drive, so that its first block contains the end of a step response.  The current is
nearly settled and changes little within the block, but not along a parabola, and the voltage is not settled.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.misfit import misfit

LEAST_BLOCKS = 8  # of the first dwell: fewer do not determine the scatter
MOST_DROPPED = 3
RINGS = 4.0  # times the usual standard deviation
RINGING = 0.1  # largest share of the blocks
FAR = 8.0  # standard deviations


def settled(view):
    """The view without first blocks whose misfit is far from the line through the following blocks."""
    first = view.run == view.run[0]
    u = misfit(view)["u"]
    start = ringing(np.std(u, axis=1))
    level = u.mean(axis=1)[first]
    while start < MOST_DROPPED and len(level) - start >= LEAST_BLOCKS and swings(level[start:]):
        start += 1
    return view.take(np.arange(start, len(view))) if start else view


def ringing(spread) -> int:
    """Number of first blocks, of (b,) standard deviations of their rows' misfit, that ring as no later block does.

    Currents that ring at power-up have no voltage of the control, and a mean that does not show it.
    """
    usual = np.median(spread)
    rings = np.append(spread > RINGS * usual, False)
    lasts = int(np.argmin(rings))
    return lasts if lasts <= RINGING * len(spread) and rings.sum() == lasts else 0


def swings(level) -> bool:
    """Whether the first of a dwell's mean misfits (n,), complex dq [V], is far from the line through the next four.

    A line allows for a steady drift; the scatter is that of the later blocks.
    """
    near, far = level[1:3].mean(), level[3:5].mean()
    scatter = np.median(np.abs(np.diff(level[1:]))) / np.sqrt(2.0 * 2.0 * np.log(2.0))
    return bool(abs(level[0] - near - 0.75 * (near - far)) > FAR * scatter)
