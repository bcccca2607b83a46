"""The start of a recording in which the drive still swings in.

A recording often starts with the drive: the first block then holds what is left of a step from nothing.  The current
is nearly there and changes by little within the block, but not along a parabola, and the voltage has far to go.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance import misfit

LEAST_BLOCKS = 8  # of the first dwell: fewer do not say what the scatter is
MOST_DROPPED = 3
FAR = 8.0  # standard deviations


def settled(view):
    """The view without those first blocks that are not in line with the blocks after them."""
    first = view.run == view.run[0]
    level = misfit(view)["u"].mean(axis=1)[first]
    start = 0
    while start < MOST_DROPPED and len(level) - start >= LEAST_BLOCKS and swings(level[start:]):
        start += 1
    return view.take(np.arange(start, len(view))) if start else view


def swings(level) -> bool:
    """Whether the first of a dwell's mean misfits (n,), complex dq [V], is far from the line through the next four.

    A line, as what drifts goes on drifting; the scatter is that of the later blocks.
    """
    near, far = level[1:3].mean(), level[3:5].mean()
    scatter = np.median(np.abs(np.diff(level[1:]))) / np.sqrt(2.0 * 2.0 * np.log(2.0))
    return bool(abs(level[0] - near - 0.75 * (near - far)) > FAR * scatter)
