# SPDX-License-Identifier: BSD-3-Clause
"""Rows of the balance as complex amplitudes of one order, a value for each block."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.arrays import Complex

LEAST_ROOM = 0.2  # least 1 - |leakage|^2 of the constant into a harmonic: with less the block holds no whole wave


def at_order(cells, values, order) -> Complex:
    """Values (r,) of channel u at an order as complex (b,), nan in blocks that do not resolve it."""
    rows = (cells.channel == "u") & (cells.order == order)
    out = np.full(cells.block.max() + 1, np.nan + 0j)
    d, q = rows & (cells.part == 0), rows & (cells.part == 1)
    seen = cells.ok[d] | (cells.ok[q] if order == 0 else False)  # a d voltage that was not recorded is shown as zero
    part = np.where(cells.ok[d], values[d], 0.0)
    out[cells.block[d]] = np.where(seen, part, np.nan) + 1j * np.where(cells.ok[q], values[q], np.nan)
    return out


def harmonic(view, cells, values, order) -> Complex:
    """``at_order`` of a harmonic without the leakage of the constant, complex (b,): blocks are no whole turns.

    The least-squares amplitude beside a constant in the block.
    """
    wave = at_order(cells, values, order)
    if order == 0:
        return wave
    leak = np.exp(-1j * order * view.theta_mid).mean(axis=1)
    constant = np.nan_to_num(at_order(cells, values, 0.0))
    return (wave - constant * leak) / (1.0 - np.abs(leak) ** 2).clip(LEAST_ROOM)


def rms(x):
    """Root mean square of the finite ones of real or complex values; 0 without any."""
    x = x[np.isfinite(x)]
    return float(np.sqrt(np.mean(np.abs(x) ** 2))) if len(x) else 0.0
