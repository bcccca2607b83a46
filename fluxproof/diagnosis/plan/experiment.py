# SPDX-License-Identifier: BSD-3-Clause
"""Choice of a few operating points that together separate tied explanations best (optimal experiment design).

The distance of two fixed predictions overestimates the separation, since a rival is refitted to the new points.  The
criterion is the misfit that then remains for the rival, over the old rows and the new ones:

    D^2 = min over b of |d - X b|^2 + b' P b = d'd - g' (P + X'X)^-1 g,   g = X'd

d: prediction of the explanation assumed true minus that of the rival at the new points; X: the rival's columns there,
both in standard deviations; P: information of the old rows about the rival's coefficients.  d'd, g and X'X are sums
over the points, so that many sets can be evaluated.  The best set maximises the D^2 of the closest pair.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ENOUGH = 400.0  # D^2 above which more has no benefit
EQUALS = 0.05  # weight of the mean over all pairs relative to the closest pair; it decides between equal sets
ROUNDS = 4  # largest number of exchange rounds
BENDS = 1.0  # of an effect's size: bound on a part of its curve that no row determines


@dataclass
class Rivalry:
    """One explanation assumed true, another one fitted to it; arrays over the candidates (n, ...)."""

    power: np.ndarray  # (n,) d'd
    taken: np.ndarray  # (n, k) X'd
    gram: np.ndarray  # (n, k, k) X'X
    known: np.ndarray  # (k, k) P

    def left(self, points) -> float:
        """D^2 of a set of candidates."""
        *rest, last = points
        return float(self.left_with(rest)[last])

    def left_with(self, rest) -> np.ndarray:
        """(n,) D^2 of a set of candidates with each further one."""
        g = self.taken[rest].sum(axis=0) + self.taken
        room = self.known + self.gram[rest].sum(axis=0) + self.gram
        taken = np.einsum("nk,nk->n", g, np.linalg.solve(room, g[..., None])[..., 0])
        return np.maximum(self.power[rest].sum() + self.power - taken, 0.0)


def rivalry(truth, rival, columns, known, sigma, block, count) -> Rivalry:
    """The Rivalry of the predictions `truth` and `rival`, both rows (r,) at the candidates.

    columns: (k, r) of the rival; known: (k, k) P; sigma: (r,), inf for unused rows; block: (r,) candidate of a row.
    """
    d, x = (truth - rival) / sigma, columns / sigma
    scale = np.sqrt(np.diag(known))
    x, known = x / scale[:, None], known / np.outer(scale, scale)
    k = len(x)
    power, taken, gram = np.zeros(count), np.zeros((count, k)), np.zeros((count, k, k))
    np.add.at(power, block, d**2)
    np.add.at(taken, block, (x * d).T)
    np.add.at(gram, block, np.einsum("ir,jr->rij", x, x))
    return Rivalry(power, taken, gram, known + 1e-9 * np.eye(k))


def closest(left, enough=np.inf) -> np.ndarray:
    """D^2 of the closest pair, limited to ``enough``; left: (pairs, ...)."""
    return np.minimum(left, enough).min(axis=0)


def closest_distance(rivalries, points) -> float:
    """D^2 of the closest pair at a set of candidates."""
    return float(closest(np.array([r.left(points) for r in rivalries]))) if points else 0.0


def values(rivalries, rest, cost, enough=np.inf) -> np.ndarray:
    """(n,) value of a set of candidates with each further one: the closest pair's D^2, then the mean of all pairs.

    cost: (n,) penalty of a candidate, as a share of D^2.  Repeating a candidate of the set is excluded, since the error
    of the balance at a point repeats too.
    """
    left = np.array([r.left_with(rest) for r in rivalries])
    worth = np.log1p(closest(left, enough)) + EQUALS * np.log1p(left).mean(axis=0) - cost
    worth[rest] = -np.inf
    return worth


def spare_values(rivalries, rest, cost) -> np.ndarray:
    """(n,) the same with D^2 limited to ENOUGH, plus the value of each subset that lacks one other point."""
    worth = values(rivalries, rest, cost, ENOUGH)
    for k in rest:
        left = np.array([r.left_with([n for n in rest if n != k]) for r in rivalries])
        worth = worth + np.log1p(closest(left, ENOUGH))
    return worth


def best_points(rivalries, most, doubt: float | np.ndarray = 0.0, strain: float | np.ndarray = 0.0) -> list[int]:
    """`most` different candidates that maximise the closest pair's D^2, the least dispensable first.

    doubt, strain: (n,) penalties of a candidate, as a share of D^2.  ``strain`` counts only if ENOUGH is reached.
    """
    chosen = []
    while len(chosen) < most:
        chosen.append(int(np.argmax(values(rivalries, chosen, doubt))))
    chosen = exchanged(rivalries, chosen, values, doubt)
    if closest_distance(rivalries, chosen) >= ENOUGH:
        chosen = exchanged(rivalries, chosen, spare_values, doubt + strain)
    return sorted(chosen, key=lambda k: closest_distance(rivalries, [n for n in chosen if n != k]))


def exchanged(rivalries, chosen, worth_of, cost) -> list[int]:
    """A set of candidates, improved by exchanging one at a time until nothing improves."""
    chosen = list(chosen)
    for _ in range(ROUNDS):
        before = list(chosen)
        for place in range(len(chosen)):
            worth = worth_of(rivalries, chosen[:place] + chosen[place + 1 :], cost)
            if worth.max() > worth[chosen[place]] + 1e-9:
                chosen[place] = int(np.argmax(worth))
        if chosen == before:
            break
    return chosen
