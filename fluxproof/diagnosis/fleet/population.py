# SPDX-License-Identifier: BSD-3-Clause
"""Mean, spread and shrunk values of a parameter over the drives of one design.

Drive i has the true value theta_i ~ N(mu, tau^2); its recordings say x_i with the standard deviation s_i.  A drive that
is faulty is no part of that: with the probability epsilon its x_i comes from a normal FAULTY_WIDE times as wide.  mu,
tau and epsilon maximise the restricted likelihood of

    x_i ~ (1 - epsilon) N(mu, v_i) + epsilon N(mu, FAULTY_WIDE^2 v_i),    v_i = tau^2 + s_i^2
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from fluxproof.diagnosis.ground import constants as k


@dataclass(frozen=True)
class Population:
    """A parameter of a design.  mean, mean_sigma, spread, spread_sigma: mu and tau with their uncertainty.

    effect, parameter, unit; serials: of the drives; x, s: (n,) pooled value and sigma of each; shrunk, shrunk_sigma:
    (n,) what is believed of the drive in the light of the others; inlier: (n,) probability of being one of them;
    z: (n,) distance from the others in predictive standard deviations; p: (n,) its two-sided probability.
    """

    effect: str
    parameter: str
    unit: str
    serials: tuple[str, ...]
    x: np.ndarray
    s: np.ndarray
    mean: float
    mean_sigma: float
    spread: float
    spread_sigma: float
    faulty: float
    shrunk: np.ndarray
    shrunk_sigma: np.ndarray
    inlier: np.ndarray
    z: np.ndarray
    p: np.ndarray


def pooled(values, sigmas) -> tuple[float, float]:
    """(value, sigma) of several recordings of one drive: weighted, sigma widened by what they differ (Birge)."""
    x, s = np.asarray(values, float), np.asarray(sigmas, float)
    w = 1.0 / s**2
    mean = float(w @ x / w.sum())
    ratio = 1.0
    if len(x) > 1:
        ratio = max(1.0, float(np.sqrt(w @ (x - mean) ** 2 / (len(x) - 1))))
    return mean, float(ratio / np.sqrt(w.sum()))


def population(effect, parameter, unit, serials, x, s) -> Population | None:
    """The population of values x (n,) with standard deviations s (n,); None for fewer than POPULATION_DRIVES drives."""
    x, s = np.asarray(x, float), np.asarray(s, float)
    if len(x) < k.POPULATION_DRIVES:
        return None
    centre = float(np.median(x))
    scatter = stats.median_abs_deviation(x, scale="normal")  # pyright: ignore[reportArgumentType]  # a word of scipy's
    scale = max(float(scatter), float(np.median(s)), 1e-12 * abs(centre), 1e-300)
    u, e = (x - centre) / scale, s / scale
    mu, tau, epsilon, spread_sigma = _fitted(u, e)
    v = tau**2 + e**2
    inlier = _inlier(u, mu, v, epsilon)
    w = inlier / v
    mean_var = 1.0 / max(w.sum(), 1e-12)
    shrunk, var = _shrunk(u, e, mu, tau, mean_var, inlier)
    freedom = max(float(inlier.sum()) - 1.0, 1.0)
    z = (u - mu) / np.sqrt(v + mean_var)
    p = 2.0 * stats.t.sf(np.abs(z), freedom)
    return Population(
        effect, parameter, unit, tuple(serials), x, s,
        centre + scale * mu, scale * float(np.sqrt(mean_var)), scale * tau, scale * spread_sigma, epsilon,
        centre + scale * shrunk, scale * np.sqrt(var), inlier, z, p,
    )  # fmt: skip


def _fitted(u, e) -> tuple[float, float, float, float]:
    """(mu, tau, epsilon, sigma of tau) of standardised values, by the restricted likelihood."""

    def loss(q):
        mu, tau, epsilon = q[0], abs(q[1]), k.MOST_FAULTY / (1.0 + np.exp(-q[2]))
        v = tau**2 + e**2
        inlier = _inlier(u, mu, v, epsilon)
        restricted = -0.5 * np.log(max((inlier / v).sum(), 1e-12))
        a, b = 1.0, k.ONE_FAULTY_IN  # Beta distribution
        prior = (a - 1.0) * np.log(epsilon) + (b - 1.0) * np.log1p(-epsilon)
        return -(_log_density(u, mu, v, epsilon).sum() + restricted + prior)

    starts = ((0.0, t, -2.0) for t in (0.3, 1.0))
    options = dict(method="Nelder-Mead", options=dict(xatol=1e-5, fatol=1e-7, maxiter=4000))
    best = min((optimize.minimize(loss, s, **options) for s in starts), key=lambda found: found.fun)
    mu, tau, epsilon = float(best.x[0]), abs(float(best.x[1])), float(k.MOST_FAULTY / (1.0 + np.exp(-best.x[2])))
    step = 0.02 * max(tau, float(np.median(e)))
    at = [loss((mu, t, best.x[2])) for t in (max(tau, step) - step, max(tau, step), max(tau, step) + step)]
    curvature = (at[0] - 2.0 * at[1] + at[2]) / step**2
    freedom = max(len(u) - 1.0, 1.0)
    wide = float(np.sqrt((tau**2 + np.median(e) ** 2) / (2.0 * freedom)))
    return mu, tau, epsilon, float(1.0 / np.sqrt(curvature)) if curvature > 1.0 / (4.0 * wide) ** 2 else wide


def _log_density(u, mu, v, epsilon):
    d2 = (u - mu) ** 2 / v
    common = -0.5 * np.log(2.0 * np.pi * v)
    outside = np.log(epsilon) - np.log(k.FAULTY_WIDE) - 0.5 * d2 / k.FAULTY_WIDE**2
    return common + np.logaddexp(np.log1p(-epsilon) - 0.5 * d2, outside)


def _inlier(u, mu, v, epsilon):
    """(n,) probability of each value to be of the population."""
    d2 = (u - mu) ** 2 / v
    inside = np.log1p(-epsilon) - 0.5 * d2
    outside = np.log(epsilon) - np.log(k.FAULTY_WIDE) - 0.5 * d2 / k.FAULTY_WIDE**2
    return np.exp(inside - np.logaddexp(inside, outside))


def _shrunk(u, e, mu, tau, mean_var, inlier):
    """(values, variances) of the drives: a mixture of a member of the population and of a faulty one."""
    out = []
    for variance in (tau**2, k.FAULTY_WIDE**2 * (tau**2 + e**2) - e**2):
        b = variance / (variance + e**2)
        out.append((mu + b * (u - mu), b * e**2 + (1.0 - b) ** 2 * mean_var))
    (inside, inside_var), (outside, outside_var) = out
    value = inlier * inside + (1.0 - inlier) * outside
    between = inlier * (1.0 - inlier) * (inside - outside) ** 2
    return value, inlier * inside_var + (1.0 - inlier) * outside_var + between
