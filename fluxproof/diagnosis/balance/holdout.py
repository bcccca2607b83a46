# SPDX-License-Identifier: BSD-3-Clause
"""Which blocks of a recording are held out of the fit, to see whether what was found predicts them."""

from __future__ import annotations

import numpy as np

EVERY = 4  # every fourth dwell is held out
FEW = 2 * EVERY  # with fewer dwells, every fourth block is


def holdout_blocks(view) -> np.ndarray:
    """(b,) bool: blocks held out of the fit: every fourth dwell, or every fourth block if there are few dwells."""
    dwells = np.unique(view.run)
    if len(dwells) >= FEW:
        return np.isin(view.run, dwells[2::EVERY])
    return np.arange(len(view)) % EVERY == 2


def held_out(views) -> np.ndarray:
    """(b,) bool: blocks held out of the fit, a part of each recording and never the whole of one."""
    return np.concatenate([holdout_blocks(v) for v in views])
