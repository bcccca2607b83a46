# SPDX-License-Identifier: BSD-3-Clause
"""The marginal likelihood of a set of effects, with the sizes of the effects and of the discrepancy learnt.

    y = X c + d + q + e,   e ~ N(0, s^2),   d ~ N(0, (lambda_g l)^2),   q ~ N(0, (mu_g w)^2),   c_k ~ N(0, (a_e p_k)^2)

a_e is the size of effect e in units of its floor of practical interest, with a log-uniform prior from 1 to the size at
which a drive no longer runs; p_k is the coefficient that makes column k as large as the floor (of a curve: the share of
it by which the curve may depart from the formula at most).  Of the curve of an effect p_k is multiplied by b_e, with a
log-uniform prior from ``straight`` to 1: a curve that is not needed is no reason against its effect.  lambda_g is the
discrepancy of group g, with the prior 1 / (1 + (lambda / k)^2), and at least 1 where the error of the balance is known.
w is the error that the curve of an effect may have at most, and mu_g <= 1 the share of it that is seen in group g: with
all of it, a set would gain by a smaller effect with a smaller w.  All are found by expectation maximisation; the log
evidence is exact for them.
"""

from __future__ import annotations

import numba
import numpy as np

STEPS, SETTLED = 20, 0.03  # most steps; relative change of all sizes and lambda after which one step more is enough
SMALL, LARGE = 1e-200, 1e200  # range of a product of variances, each of which lies within 1e-100 and 1e100
FACTORS = np.array([0.1, 0.35, 0.7, 1.0, 1.4, 3.0, 10.0])  # of the discrepancy: the grid of every step
SEEN = np.array([0.0, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0])  # shares mu: the grid of every step


@numba.njit(cache=True, error_model="numpy")
def _share_seen(mu, lam, s2, level2, doubt2, own, e2, group, loads):
    """Choose the share mu (groups,) of the curves' errors that is seen in each group, at the discrepancy lam."""
    score = np.zeros((len(mu), len(SEEN)))
    for i in range(len(s2)):
        g = group[i]
        if g != loads and doubt2[i] > 0.0:
            known = s2[i] + own[i] + lam[g] ** 2 * level2[i]
            for h in range(len(SEEN)):
                u = known + SEEN[h] ** 2 * doubt2[i]
                score[g, h] -= 0.5 * (e2[i] / u + np.log(u))
    for g in range(len(mu)):
        mu[g] = SEEN[np.argmax(score[g])]


@numba.njit(cache=True, error_model="numpy")  # no division here is by zero, which need not be checked in every row
def evidence(
    x, y, s2, level, doubt, group, groups, loads, load, prior, owner, core, most, formula, scale, least, always, start,
    straight,
):
    """(log evidence, coefficients (k,), covariance (k, k), sizes (effects,), lambda and mu (groups,)).

    x: (n, k) columns of the set; doubt: (n,) errors w of curves; prior: (k,) p_k; owner: (k,) effect of a column;
    core: (k,) bool, a column of the formula and not of the free curve; most: (effects,) largest size.
    loads, load: group whose rows may contain a load of the scale ``load`` each, -1: none.
    start: torque, in multiples of the smallest one, above which a row is first taken as loaded.
    always: odds against a load at every operating point.
    formula: (effects,) share of a contribution that counts as discrepancy; scale: prior of lambda; least: smallest
    one; straight: smallest b_e.  Where a load hides the discrepancy, lambda stays at its scale.
    """
    n, k = x.shape
    effects = len(most)
    a = np.sqrt(most)
    bend = np.ones(effects)
    lam = np.full(groups, scale)
    mu = np.ones(groups)
    c = np.zeros(k)
    cov = np.zeros((k, k))
    columns = np.ascontiguousarray(x.T)  # rows one after the other in memory, for every loop over them
    v = np.zeros(n)
    own = np.zeros(n)
    loaded = np.zeros(n)
    weighted = np.zeros((k, n))
    level2 = level**2
    doubt2 = doubt**2
    doubtful = doubt2.max() > 0.0 if n else False
    e2 = np.zeros(n)
    part = np.zeros(n)
    squares = np.zeros((groups, len(FACTORS)))
    lightest = 1e300
    last = STEPS - 1
    for i in range(n):
        if group[i] == loads:
            lightest = min(lightest, abs(y[i]) + level[i])
    for i in range(n):
        if group[i] == loads and abs(y[i]) > start * lightest:
            loaded[i] = load * load
    value = 0.0
    for step in range(STEPS):
        power = 0.0
        logdet = 0.0
        product = 1.0  # a logarithm of many factors at once, before the product leaves the range of a float
        for i in range(n):
            g = group[i]
            v[i] = s2[i] + lam[g] ** 2 * level2[i] + mu[g] ** 2 * doubt2[i] + own[i] + loaded[i]
            power += y[i] * y[i] / v[i]
            product *= v[i]
            if not SMALL < product < LARGE:
                logdet += np.log(product)
                product = 1.0
        logdet += np.log(product)
        for p in range(k):
            for i in range(n):
                weighted[p, i] = columns[p, i] / v[i]
        precision = np.dot(weighted, x)
        right = np.dot(weighted, y)
        before = 0.0
        sd = np.zeros(k)
        for p in range(k):
            sd[p] = a[owner[p]] * prior[p] * (1.0 if core[p] else bend[owner[p]])
        # in units of the prior's standard deviation
        m = np.zeros((k, k))
        b = np.zeros(k)
        for p in range(k):
            b[p] = right[p] * sd[p]
            for q in range(k):
                m[p, q] = precision[p, q] * sd[p] * sd[q]
            m[p, p] += 1.0
        gain = 0.0
        if k:
            factor = np.linalg.cholesky(m)
            for p in range(k):
                before += 2.0 * np.log(factor[p, p])
            inverse = np.linalg.inv(m)
            z = inverse @ b
            for p in range(k):
                gain += z[p] * b[p]
                c[p] = z[p] * sd[p]
                for q in range(k):
                    cov[p, q] = inverse[p, q] * sd[p] * sd[q]
        value = -0.5 * (power - gain + before + logdet)
        for g in range(groups):
            value -= np.log(1.0 + (lam[g] / scale) ** 2)
        if step == last:
            break
        moved = 0.0
        # sizes of the effects, and of their curves relative to them
        sums = np.zeros((effects, 2))
        counts = np.zeros((effects, 2))
        for p in range(k):
            kind = 0 if core[p] else 1
            sums[owner[p], kind] += (c[p] ** 2 + cov[p, p]) / prior[p] ** 2
            counts[owner[p], kind] += 1.0
        for e in range(effects):
            if counts[e, 0] > 0:
                size = min(max(np.sqrt(sums[e, 0] / counts[e, 0]), 1.0), most[e])
                moved = max(moved, abs(size / a[e] - 1.0))
                a[e] = size
            if counts[e, 1] > 0:
                bend[e] = min(max(np.sqrt(sums[e, 1] / counts[e, 1]) / a[e], straight), 1.0)
        # expected squares of the remainder, and the share of each effect's contribution
        spread = np.dot(cov, columns)
        for i in range(n):
            e2[i] = y[i]
            own[i] = 0.0
        for e in range(effects):
            for i in range(n):
                part[i] = 0.0
            for p in range(k):
                if owner[p] == e:
                    for i in range(n):
                        part[i] += columns[p, i] * c[p]
            for i in range(n):
                e2[i] -= part[i]
                own[i] += (formula[e] * part[i]) ** 2
        for i in range(n):
            e2[i] *= e2[i]
        for p in range(k):
            for i in range(n):
                e2[i] += spread[p, i] * columns[p, i]
        # discrepancy: the log density at several lambda; a row with a load is left out
        score = np.zeros((groups, len(FACTORS)))
        products = np.ones((groups, len(FACTORS)))
        for g in range(groups):
            for h in range(len(FACTORS)):
                squares[g, h] = max(lam[g] * FACTORS[h], least) ** 2
        for i in range(n):
            g = group[i]
            known = s2[i] + own[i] + mu[g] ** 2 * doubt2[i]
            if g == loads:
                u = known + scale**2 * level2[i]
                with_load = u + load * load
                loaded[i] = load * load if e2[i] / with_load + np.log(with_load) < e2[i] / u + np.log(u) else 0.0
                continue
            for h in range(len(FACTORS)):
                u = known + squares[g, h] * level2[i]
                score[g, h] -= 0.5 * e2[i] / u
                products[g, h] *= u
            if products[g, 0] < SMALL or products[g, -1] > LARGE:
                for h in range(len(FACTORS)):
                    score[g, h] -= 0.5 * np.log(products[g, h])
                    products[g, h] = 1.0
        for g in range(groups):
            best, chosen = -1e300, lam[g]
            for h in range(len(FACTORS)):
                tried = max(lam[g] * FACTORS[h], least)
                total = score[g, h] - 0.5 * np.log(products[g, h]) - np.log(1.0 + (tried / scale) ** 2)
                if total > best:
                    best, chosen = total, tried
            if g != loads:
                moved = max(moved, abs(chosen / lam[g] - 1.0) if lam[g] > 0.0 else chosen)
            lam[g] = chosen if g != loads else scale
        if doubtful:
            _share_seen(mu, lam, s2, level2, doubt2, own, e2, group, loads)
        if moved < SETTLED:
            last = step + 1
    if loads >= 0:  # a drive is run without load at one of its operating points at least
        free = 0
        rows = 0
        for i in range(n):
            if group[i] == loads:
                rows += 1
                free += loaded[i] == 0.0
        if rows and not free:
            value -= np.log(always)
    return value, c, cov, a, lam, mu
