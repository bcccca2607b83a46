# SPDX-License-Identifier: BSD-3-Clause
"""Tensor-product splines over the dq current plane, and the EMF of the derivatives of each of them in a block.

A co-energy W = sum of w_jk B_j(i_d) B_k(i_q) has the flux dW/di_d + j dW/di_q; the splines are cubic, on equal steps.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline

INTERVALS = 22  # along each axis: finer than the curves of a machine; the penalty smooths them


def knots_over(x) -> np.ndarray:
    """Knots of cubic splines over a range slightly wider than that of x."""
    low, high = x.min(), x.max()
    step = (high - low) * 1.02 / INTERVALS
    return 0.5 * (low + high) + step * (np.arange(-3, INTERVALS + 4) - 0.5 * INTERVALS)


def powers(knots) -> np.ndarray:
    """(3, n) spline weights that represent 1, x and x^2 exactly (Marsden's identity)."""
    inner = np.stack([knots[1 + k : len(knots) - 3 + k] for k in range(3)])
    pairs = (inner[0] * inner[1] + inner[0] * inner[2] + inner[1] * inner[2]) / 3.0
    return np.stack([np.ones(inner.shape[1]), inner.mean(axis=0), pairs])


def gradients(i, knots_d, knots_q):
    """Sparse (p, n_d * n_q) complex: dB/di_d + j dB/di_q of every tensor spline at dq currents (p,)."""
    values, slopes = [], []
    for x, knots in ((i.real, knots_d), (i.imag, knots_q)):
        x = np.clip(x, knots[3], knots[-4] - 1e-9)
        value = BSpline.design_matrix(x, knots, 3)
        # The derivative of a cubic B-spline on equal steps is the difference of two quadratic ones.
        lower = BSpline.design_matrix(x, knots[1:-1], 2)
        n, step = value.shape[1], knots[1] - knots[0]
        difference = sparse.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n))
        slopes.append((lower @ difference / step).tocsr())
        values.append(value.tocsr())
    return _product(slopes[0], values[1]) + 1j * _product(values[0], slopes[1])


def _product(first, second):
    """Row-wise Kronecker product of two sparse matrices with the same number of rows."""
    p, n, m = first.shape[0], first.shape[1], second.shape[1]
    a, b = first.tocoo(), second.tocsr()
    counts = np.diff(b.indptr)[a.row]
    start = np.repeat(b.indptr[a.row], counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    at = start + within
    rows, columns = np.repeat(a.row, counts), np.repeat(a.col, counts) * m + b.indices[at]
    return sparse.csr_matrix((np.repeat(a.data, counts) * b.data[at], (rows, columns)), shape=(p, n * m))


def emf_columns(view, knots_d, knots_q):
    """(b, n_d * n_q) complex: mean EMF of every tensor spline's flux over each block [V]."""
    b, samples = view.i.shape
    half = np.exp(0.5j * np.diff(view.theta, axis=1)) / view.sample_time_s / (samples - 1)
    weight = np.zeros((b, samples), complex)
    weight[:, 1:] += half
    weight[:, :-1] -= np.conj(half)
    mean = sparse.csr_matrix(
        (weight.ravel(), (np.repeat(np.arange(b), samples), np.arange(b * samples))), shape=(b, b * samples)
    )
    return (mean @ gradients(view.i.ravel(), knots_d, knots_q)).toarray()
