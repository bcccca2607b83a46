# SPDX-License-Identifier: BSD-3-Clause
"""The marginal likelihood of a set of effects, with the sizes of the effects and of the discrepancy learnt (model.py).

Expectation maximisation: coefficients at the present sizes, sizes at these coefficients, then the discrepancy of each
group and the share of the curves' errors that its residual shows.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from fluxproof.diagnosis.inference.model import BalanceRows, Columns, Found, Prior

STEPS, SETTLED = 20, 0.03  # most steps; relative change of all sizes and lambda after which one step more is enough
SMALL, LARGE = 1e-200, 1e200  # range of a product of variances, each of which lies within 1e-100 and 1e100
FACTORS = np.array([0.1, 0.35, 0.7, 1.0, 1.4, 3.0, 10.0])  # of the discrepancy: the grid of every step
SEEN = np.array([0.0, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0])  # shares mu: the grid of every step
STRAINED = 2.0  # standard deviations beyond which a torque is not explained without a load
FORMULA, CURVE = 0, 1  # kinds of columns

jit = numba.njit(cache=True, error_model="numpy")  # no division here is by zero, which need not be checked in every row


class _State(NamedTuple):
    """Arrays that a step changes in place."""

    sizes: np.ndarray  # (effects,)
    bend: np.ndarray  # (effects,)
    lam: np.ndarray  # (groups,)
    mu: np.ndarray  # (groups,)
    c: np.ndarray  # (k,)
    cov: np.ndarray  # (k, k)
    v: np.ndarray  # (n,) variance of the rows at these coefficients
    m: np.ndarray  # (k, k) posterior precision in units of the prior's deviation
    z: np.ndarray  # (k,) coefficients in units of the prior's deviation
    own: np.ndarray  # (n,) variance of the formulas' errors
    loaded: np.ndarray  # (n,) variance of the load in the row
    squares: np.ndarray  # (n,) expected squares of the residual
    error2: np.ndarray  # (n,) squares of the rows' errors, which do not change
    curve2: np.ndarray  # (n,)


@jit
def evidence(rows: BalanceRows, columns: Columns, prior: Prior, start: float) -> Found:
    """The evidence of a set of effects and its most probable sizes.

    start: torque, in multiples of the smallest one, above which a row is first taken as loaded.
    Where a load hides the discrepancy, lambda stays at its scale.
    """
    k, n = columns.x.shape
    state = _State(
        np.sqrt(columns.most), np.ones(len(columns.most)), np.full(rows.groups, prior.typical), np.ones(rows.groups),
        np.zeros(k), np.zeros((k, k)), np.zeros(n), np.zeros((k, k)), np.zeros(k),
        np.zeros(n), _first_loads(rows, start), np.zeros(n), rows.error**2, rows.curve_error**2,
    )  # fmt: skip
    weighted = np.zeros((k, n))
    doubtful = state.curve2.max() > 0.0 if n else False
    last = STEPS - 1
    for step in range(STEPS):
        _coefficients(rows, columns, weighted, state)
        if step == last:
            break
        moved = _sizes(columns, prior, state)
        _residual(rows, columns, state)
        moved = max(moved, _discrepancy(rows, prior, state))
        if doubtful:
            _share_seen(rows, state)
        if moved < SETTLED:
            last = step + 1
    value = _log_evidence(rows, columns, prior, state) - _log_never_free(rows, prior, state)
    return Found(value, state.c, state.cov, state.sizes, state.lam, state.mu, _strained(rows, prior, state))


@jit
def _first_loads(rows, start):
    """(n,) variance of the load in the rows whose torque is above ``start`` times the smallest one."""
    loaded = np.zeros(len(rows.y))
    lightest = 1e300
    for i in range(len(rows.y)):
        if rows.group[i] == rows.loads:
            lightest = min(lightest, abs(rows.y[i]) + rows.error[i])
    for i in range(len(rows.y)):
        if rows.group[i] == rows.loads and abs(rows.y[i]) > start * lightest:
            loaded[i] = rows.load * rows.load
    return loaded


@jit
def _coefficients(rows, columns, weighted, state):
    """Coefficients and their covariance at the sizes of ``state``."""
    k, n = columns.x.shape
    weight = np.zeros(n)
    for i in range(n):
        g = rows.group[i]
        v = rows.variance[i] + state.lam[g] ** 2 * state.error2[i] + state.mu[g] ** 2 * state.curve2[i]
        v += state.own[i]
        state.v[i] = v + state.loaded[i]
        weight[i] = 1.0 / state.v[i]
    if k == 0:
        return
    for p in range(k):
        for i in range(n):
            weighted[p, i] = columns.x[p, i] * weight[i]
    precision = np.dot(weighted, columns.x.T)
    right = np.dot(weighted, rows.y)
    deviation = np.zeros(k)
    for p in range(k):
        e = columns.owner[p]
        deviation[p] = state.sizes[e] * columns.scale[p] * (1.0 if columns.core[p] else state.bend[e])
    m = state.m
    for p in range(k):
        for q in range(k):
            m[p, q] = precision[p, q] * deviation[p] * deviation[q]
        m[p, p] += 1.0
    inverse = np.linalg.inv(m)
    solved = np.dot(inverse, right * deviation)
    for p in range(k):
        state.z[p] = solved[p]
        state.c[p] = solved[p] * deviation[p]
        for q in range(k):
            state.cov[p, q] = inverse[p, q] * deviation[p] * deviation[q]


@jit
def _log_evidence(rows, columns, prior, state):
    """log p(y) = -1/2 (r' V^-1 r + z' z + log|V| + log|M|), and the prior of lambda.

    r is what X c leaves; y' V^-1 y less what is explained would be nothing but rounding where nearly all of a huge
    misfit is explained.
    """
    left = rows.y - np.dot(state.c, columns.x)
    power, twice_log_m = 0.0, 0.0
    product = 1.0  # a logarithm of many factors at once, before the product leaves the range of a float
    logdet = 0.0
    for i in range(len(left)):
        power += left[i] * left[i] / state.v[i]
        product *= state.v[i]
        if not SMALL < product < LARGE:
            logdet += np.log(product)
            product = 1.0
    logdet += np.log(product)
    if len(state.z):
        power += np.dot(state.z, state.z)
        twice_log_m = 2.0 * np.sum(np.log(np.diag(np.linalg.cholesky(state.m))))
    value = -0.5 * (power + twice_log_m + logdet)
    for g in range(rows.groups):
        value -= prior.steep * np.log(1.0 + (state.lam[g] / prior.typical) ** 2)
    return value


@jit
def _sizes(columns, prior, state):
    """Sizes of the effects, and of their curves relative to them; the largest relative change of a size."""
    moved = 0.0
    sums = np.zeros((len(columns.most), 2))
    counts = np.zeros((len(columns.most), 2))
    for p in range(len(state.c)):
        kind = FORMULA if columns.core[p] else CURVE
        sums[columns.owner[p], kind] += (state.c[p] ** 2 + state.cov[p, p]) / columns.scale[p] ** 2
        counts[columns.owner[p], kind] += 1.0
    for e in range(len(columns.most)):
        if counts[e, FORMULA] > 0:
            size = min(max(np.sqrt(sums[e, FORMULA] / counts[e, FORMULA]), 1.0), columns.most[e])
            moved = max(moved, abs(size / state.sizes[e] - 1.0))
            state.sizes[e] = size
        if counts[e, CURVE] > 0:
            bend = np.sqrt(sums[e, CURVE] / counts[e, CURVE]) / state.sizes[e]
            state.bend[e] = min(max(bend, prior.straight), 1.0)
    return moved


@jit
def _residual(rows, columns, state):
    """Expected squares of the residual, and the variance of the formulas' errors in it."""
    k, n = columns.x.shape
    left = rows.y - np.dot(state.c, columns.x)
    spread = np.dot(state.cov, columns.x)
    squares, own, mine = state.squares, state.own, np.zeros(k)
    for i in range(n):
        squares[i] = left[i] * left[i]
        own[i] = 0.0
    for p in range(k):
        for i in range(n):
            squares[i] += spread[p, i] * columns.x[p, i]
    for e in range(len(columns.most)):
        if columns.formula[e] > 0.0:
            for p in range(k):
                mine[p] = state.c[p] if columns.owner[p] == e else 0.0
            part = np.dot(mine, columns.x)
            for i in range(n):
                own[i] += (columns.formula[e] * part[i]) ** 2


@jit
def _discrepancy(rows, prior, state):
    """Choose lambda of each group by the log density at several values; the largest relative change.

    BalanceRows with a load do not count: whether a row has one is chosen here too.
    """
    groups, lam = rows.groups, state.lam
    score = np.zeros((groups, len(FACTORS)))
    products = np.ones((groups, len(FACTORS)))
    tried2 = np.zeros((groups, len(FACTORS)))
    for g in range(groups):
        for h in range(len(FACTORS)):
            tried2[g, h] = max(lam[g] * FACTORS[h], prior.least) ** 2
    for i in range(len(rows.y)):
        g = rows.group[i]
        known = rows.variance[i] + state.own[i] + state.mu[g] ** 2 * state.curve2[i]
        error2 = state.error2[i]
        square = state.squares[i]
        if g == rows.loads:
            u = known + prior.typical**2 * error2
            with_load = u + rows.load * rows.load
            likelier = square / with_load + np.log(with_load) < square / u + np.log(u)
            state.loaded[i] = rows.load * rows.load if likelier else 0.0
            continue
        for h in range(len(FACTORS)):
            u = known + tried2[g, h] * error2
            score[g, h] -= 0.5 * square / u
            products[g, h] *= u
        if products[g, 0] < SMALL or products[g, -1] > LARGE:
            for h in range(len(FACTORS)):
                score[g, h] -= 0.5 * np.log(products[g, h])
                products[g, h] = 1.0
    moved = 0.0
    for g in range(groups):
        if g == rows.loads:
            lam[g] = prior.typical
            continue
        best, chosen = -1e300, lam[g]
        for h in range(len(FACTORS)):
            tried = max(lam[g] * FACTORS[h], prior.least)
            total = score[g, h] - 0.5 * np.log(products[g, h])
            total -= prior.steep * np.log(1.0 + (tried / prior.typical) ** 2)
            if total > best:
                best, chosen = total, tried
        moved = max(moved, abs(chosen / lam[g] - 1.0) if lam[g] > 0.0 else chosen)
        lam[g] = chosen
    return moved


@jit
def _share_seen(rows, state):
    """Choose the share mu of the curves' errors that is seen in each group, at its discrepancy lambda."""
    score = np.zeros((rows.groups, len(SEEN)))
    for i in range(len(rows.y)):
        g = rows.group[i]
        curve2 = state.curve2[i]
        if g != rows.loads and curve2 > 0.0:
            known = rows.variance[i] + state.own[i] + state.lam[g] ** 2 * state.error2[i]
            for h in range(len(SEEN)):
                u = known + SEEN[h] ** 2 * curve2
                score[g, h] -= 0.5 * (state.squares[i] / u + np.log(u))
    for g in range(rows.groups):
        state.mu[g] = SEEN[np.argmax(score[g])]


@jit
def _strained(rows, prior, state):
    """Whether a load may be hidden: another start can find one only where a row has one or is not explained."""
    for i in range(len(rows.y)):
        if rows.group[i] == rows.loads:
            known = rows.variance[i] + state.own[i] + prior.typical**2 * state.error2[i]
            if state.loaded[i] > 0.0 or state.squares[i] > STRAINED**2 * known:
                return True
    return False


@jit
def _log_never_free(rows, prior, state):
    """Log odds against a set in which every operating point is loaded: a drive is run without load at one at least."""
    free, count = 0, 0
    for i in range(len(rows.y)):
        if rows.group[i] == rows.loads:
            count += 1
            free += state.loaded[i] == 0.0
    return np.log(prior.always) if rows.loads >= 0 and count and not free else 0.0
