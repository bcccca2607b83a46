# SPDX-License-Identifier: BSD-3-Clause
"""Matrices over two axes, such as voltages over speed and current, as a table with a row for each of their points.

A grid is several matrices of one shape (m, n) with a vector of m and one of n values, or with their axes as matrices
too.  Other matrices are channels of one length: name[0], name[1], ...
"""

from __future__ import annotations

import numpy as np

MOST_CHANNELS = 64
LEAST_SIDE = 3  # values of an axis: (n, 3) without axes may be three phases
LEAST_MATRICES = 3  # without vectors: both axes and what lies over them


def flat(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """{name: (k,)} of squeezed numeric arrays; those of more axes, and of too many channels, are left out."""
    if grid := _grid(arrays):
        return grid
    out = {}
    for name, array in arrays.items():
        if array.ndim == 2 and min(array.shape) <= MOST_CHANNELS:
            rows = array.T if array.shape[0] > array.shape[1] else array
            out |= {f"{name}[{k}]": row for k, row in enumerate(rows)}
        elif array.ndim == 1:
            out[name] = array
    return out


def _grid(arrays) -> dict[str, np.ndarray]:
    """The columns of a grid; empty if the arrays are none."""
    matrices = {name: a for name, a in arrays.items() if a.ndim == 2}
    vectors = {name: a for name, a in arrays.items() if a.ndim == 1 and a.size > 1}
    shapes = {a.shape for a in matrices.values()}
    if len(shapes) != 1 or min(shape := shapes.pop()) < 2 or shape[0] == shape[1]:
        return _square(matrices, vectors)
    lengths = {a.size for a in vectors.values()}
    if lengths != set(shape) and (vectors or len(matrices) < LEAST_MATRICES or min(shape) <= LEAST_SIDE):
        return {}
    along = {name: np.broadcast_to(a[:, None] if a.size == shape[0] else a, shape) for name, a in vectors.items()}
    return {name: np.ravel(a) for name, a in {**along, **matrices}.items()}


def _square(matrices, vectors) -> dict[str, np.ndarray]:
    """A grid of as many speeds as currents, whose axes must be matrices: a vector would not tell which one it is."""
    shapes = {a.shape for a in matrices.values()}
    if vectors or len(matrices) < LEAST_MATRICES or len(shapes) != 1 or min(shapes.pop()) <= LEAST_SIDE:
        return {}
    return {name: np.ravel(a) for name, a in matrices.items()}
