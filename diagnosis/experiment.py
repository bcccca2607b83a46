"""Which few operating points, recorded together, leave tied explanations the least room.

The distance of two fixed predictions says too much: given the new points a rival is fitted anew, and takes up what it
can.  What counts is the misfit that is left to it then, over the old rows and the new ones:

    D^2 = min over b of |d - X b|^2 + b' P b = d'd - g' (P + X'X)^-1 g,   g = X'd

d: what the explanation taken for the truth adds at the new points beyond the rival, X: the rival's columns there, both
in standard deviations; P: what the old rows know of the rival's coefficients.  d'd, g and X'X are sums over the points,
so sets of points are tried fast: the best set is the one whose closest pair is the farthest apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ENOUGH = 400.0  # D^2 beyond which more says nothing
EQUALS = 0.05  # weight of all pairs' D^2 beside the closest one's
ROUNDS = 4  # of exchanges
BENDS = 1.0  # of an effect's own size: how far a part of its curve that no row has shown yet may go


@dataclass
class Rivalry:
    """One explanation taken for the truth, another fitted against it; arrays over the candidates (n, ...)."""

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
    """What `rival` cannot take up of `truth`, rows (r,) of both at the candidates.

    columns: (k, r) of the rival; known: (k, k); sigma: (r,), inf where a row does not count; block: (r,) its candidate.
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
    """D^2 of the closest pair, as far as it says anything; left: (pairs, ...)."""
    return np.minimum(left, enough).min(axis=0)


def closest_distance(rivalries, points) -> float:
    """D^2 of the closest pair at a set of candidates."""
    return float(closest(np.array([r.left(points) for r in rivalries]))) if points else 0.0


def values(rivalries, rest, cost, enough=np.inf) -> np.ndarray:
    """(n,) worth of a set of candidates with each further one: the closest pair's D^2; all pairs settle equals.

    cost: (n,) of a candidate, as a share of D^2 that another one may lack.  A candidate of the set is worth nothing a
    second time: what the balance is off by at a point is the same again.
    """
    left = np.array([r.left_with(rest) for r in rivalries])
    worth = np.log1p(closest(left, enough)) + EQUALS * np.log1p(left).mean(axis=0) - cost
    worth[rest] = -np.inf
    return worth


def spare_values(rivalries, rest, cost) -> np.ndarray:
    """(n,) the same where enough is enough and any other point may be lost: each bears out what the rest say."""
    worth = values(rivalries, rest, cost, ENOUGH)
    for k in rest:
        left = np.array([r.left_with([n for n in rest if n != k]) for r in rivalries])
        worth = worth + np.log1p(closest(left, ENOUGH))
    return worth


def best_points(rivalries, most, doubt=0.0, strain=0.0) -> list[int]:
    """`most` different candidates that leave the closest pair farthest apart, the least dispensable first.

    doubt, strain: (n,) of a candidate, as a share of D^2 that another one may lack.  The strain counts where there is
    more than enough to be had.
    """
    chosen = []
    while len(chosen) < most:
        chosen.append(int(np.argmax(values(rivalries, chosen, doubt))))
    chosen = exchanged(rivalries, chosen, values, doubt)
    if closest_distance(rivalries, chosen) >= ENOUGH:
        chosen = exchanged(rivalries, chosen, spare_values, doubt + strain)
    return sorted(chosen, key=lambda k: closest_distance(rivalries, [n for n in chosen if n != k]))


def exchanged(rivalries, chosen, worth_of, cost) -> list[int]:
    """A set of candidates with each exchanged for a better one until none is."""
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
