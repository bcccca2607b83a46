# SPDX-License-Identifier: BSD-3-Clause
"""Which effects are named, which stay open, and with what confidence.

The posterior compares sets of effects.  Where much of the misfit is left, something unknown is at work, and a part of
it may look like an effect: a leftover of the rms D, lying along the columns of an effect whose contribution has the rms
A, would imitate it.  The confidence in a name is therefore the posterior of its presence times 1 - exp(-(A / D)^2 / 8),
its mean over the sets with the effect: an effect twice as large as what is left may still be an imitation, and one five
times as large is not.  Beside effects that are no imitation, and that explain E in the same orders, a leftover is
rather an error of theirs, which lies along their columns: if these hold the share r of what the effect explains, the
share r + (1 - r) D^2 / (D^2 + E^2) of the leftover's power counts.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from fluxproof.diagnosis.ground import constants as k

MEDIAN = 0.6745  # of the magnitude of normal noise, in standard deviations


@dataclass
class Names:
    """confidence: {effect: probability} of the named ones; open: groups of which one effect is present.

    maybe: {effect: probability} of effects that are neither named nor an alternative.  suspects: {effect: probability}
    of causes that are as sure as a name but that no simulation carries.  fits: the sets that hold the
    mass of the posterior, the most probable first, with their probabilities.
    """

    confidence: dict[str, float]
    open: list[list[str]]
    maybe: dict[str, float]
    suspects: dict[str, float] = field(default_factory=dict)
    fits: list = field(default_factory=list)

    @property
    def said(self) -> set[str]:
        return set(self.confidence)

    def only_possible(self, fit) -> set[str]:
        """Effects of a fit that are neither named, nor an alternative, nor as sure as a name."""
        return set(fit.names) - self.said - set(self.suspects) - {n for group in self.open for n in group}

    def withheld(self, but=frozenset()) -> Names:
        """The same with nothing asserted but the effects ``but``: what else was named is possible."""
        kept = {n: p for n, p in self.confidence.items() if n in but}
        possible = {n: p for n, p in self.confidence.items() if n not in but}
        return Names(kept, [g for g in self.open if but.issuperset(g)], self.maybe | possible, {}, self.fits)


def names_of(posterior) -> Names:
    """Names and ambiguities of a posterior."""
    held, kept = 0.0, []
    for p, fit in posterior.weights():
        kept.append((p, fit))
        held += p
        if held >= 1.0 - k.LEFT_OUT:
            break
    best = posterior.best()
    real, weight = {}, {}
    for p, fit in kept:
        for name, credit in credibilities(fit).items():
            real[name] = real.get(name, 0.0) + p * credit
            weight[name] = weight.get(name, 0.0) + p
    present = {n: p * real[n] / weight[n] for n, p in posterior.present().items() if n in real}
    effects = posterior.setup.effects
    sure = {n: p for n, p in present.items() if p >= 1.0 - k.DOUBTED and n in best.names}
    named = {n: p for n, p in sure.items() if effects[n].named}
    suspects = {n: p for n, p in sure.items() if not effects[n].named}
    rest = [frozenset(fit.names) - set(sure) for _, fit in kept]
    groups = [sorted(n for n in g if present[n] >= k.OPEN) for g in alternatives(rest)]
    groups = [g for g in groups if len(g) > 1 and sum(present[n] for n in g) >= k.TOGETHER]
    # Of an alternative one effect is there; where none may be, its members are only possible.
    groups = [g for g in groups if sum(p for p, fit in kept if set(g) & set(fit.names)) >= (1.0 - k.DOUBTED) * held]
    groups = [g for g in groups if any(effects[n].named for n in g)]
    grouped = {n for g in groups for n in g}
    maybe = {n: p for n, p in present.items() if n not in sure and n not in grouped and p >= k.PRESENT}
    return Names(named, groups, maybe, suspects, kept)


def alternatives(sets) -> list[set[str]]:
    """Effects that take each other's place: connected groups of effects, each in a set in which the other is not."""
    linked: dict[str, set[str]] = {}
    for n, a in enumerate(sets):
        for b in sets[n + 1 :]:
            if a - b and b - a:
                for x in a - b:
                    linked.setdefault(x, set()).update(b - a)
                for x in b - a:
                    linked.setdefault(x, set()).update(a - b)
    groups = []
    while linked:
        todo, group = [next(iter(linked))], set()
        while todo:
            name = todo.pop()
            if name not in group:
                group.add(name)
                todo += linked.pop(name, ())
        groups.append(group)
    return groups


def _seen_discrepancy(fit) -> np.ndarray:
    """Discrepancy of every group in units of the level: where a load hides it, that of half of the points, at most."""
    p, lam = fit.problem.p, fit.lam.copy()
    mine = p.group == p.loads
    if mine.any():
        left = (p.y[mine] - p.x[mine][:, fit.take] @ fit.vector) / p.level[mine]
        lam[p.loads] = min(lam[p.loads], float(np.median(np.abs(left))) / MEDIAN)
    return lam


def credibilities(fit) -> dict[str, float]:
    """{effect of a fit: probability in (0, 1] that it is real and not an artefact of the unexplained residual}."""
    powers, real = _powers(fit), 1.0 - k.IMITATED
    found = {name: _credibility(fit, name, powers) for name in fit.names}
    sure = {name for name, p in found.items() if p >= real}
    for name in set(found) - sure:
        found[name] = _credibility(fit, name, powers, sure)
    return found


def _powers(fit) -> dict[str, np.ndarray]:
    """{effect: (groups,) power of what it explains}, of both components of an order together."""
    p, owners = fit.problem.p, np.array([fit.problem.keys[n][0] for n in fit.take])
    return {n: _power(p, p.x[:, fit.take[owners == n]] @ fit.vector[owners == n]) for n in fit.names}


def _power(p, rows) -> np.ndarray:
    """(groups,) mean squares of rows, of both components of an order together."""
    functionals = np.array([2.0 if order == 0 else 4.0 for _, order, _ in p.groups])
    count = np.maximum(np.bincount(p.group, minlength=len(p.groups)), 1)
    return np.bincount(p.group, rows**2, minlength=len(p.groups)) / count * functionals


def _beside(left, others) -> np.ndarray:
    """(groups,) what counts of the power ``left`` where the powers ``others`` are explained."""
    return left * left / np.maximum(left + sum(others), 1e-300)


def _along(fit, name, others) -> float:
    """Share of what an effect explains, as power over that of the errors, that lies along the columns of ``others``."""
    owners = np.array([fit.problem.keys[n][0] for n in fit.take])
    weighted = fit.problem.p.x[:, fit.take] / np.sqrt(fit.variance)[:, None]
    mine, theirs = weighted[:, owners == name] @ fit.vector[owners == name], weighted[:, np.isin(owners, list(others))]
    left = mine - theirs @ np.linalg.lstsq(theirs, mine, rcond=None)[0]
    return 1.0 - float(left @ left) / max(float(mine @ mine), 1e-300)


def _credibility(fit, name, powers, sure: Collection[str] = frozenset()) -> float:
    """Probability that an effect is no imitation; sure: effects that are none, and may leave an error of their own."""
    p, power = fit.problem.p, powers[name]
    level2 = np.bincount(p.group, p.level**2, minlength=len(p.groups))
    level2 /= np.maximum(np.bincount(p.group, minlength=len(p.groups)), 1)
    # A discrepancy within the error of the balance is what every recording has; errors of curves are seen as they are.
    lam = _seen_discrepancy(fit)
    left = np.where(lam > k.USUAL, lam**2 - 1.0, 0.0) * _power(p, p.level) + fit.mu**2 * _power(p, p.doubt)
    beside = _beside(left, [powers[n] for n in fit.names if n != name])
    if sure:
        along = _along(fit, name, sure)
        left = along * left + (1.0 - along) * _beside(left, [powers[n] for n in sure])
    best = (0.0, 1.0)
    # A torque that nobody measured has an unknown load in it, and speaks only for what no voltage shows.
    inferred = fit.problem.setup.load > 0.0 and name in fit.problem.cells.electrical

    def changed(means):
        """The groups of contrasts that belong to groups of means."""
        orders = {p.groups[n][:2] for n in np.flatnonzero(means)}
        return np.array([contrast and (channel, order) in orders for channel, order, contrast in p.groups], bool)

    whole = np.array([abs(order - round(order)) < 1e-6 for _, order, _ in p.groups])
    for part in {(channel, contrast) for channel, _, contrast in p.groups}:
        mine = np.array([(channel, contrast) == part for channel, _, contrast in p.groups])
        total = power[mine].sum()
        if total <= 0.0 or (inferred and part[0] == "torque"):
            continue
        own = mine & (power >= k.LIVES * total)
        if whole[own].all():  # what repeats with the electrical angle leaves nothing between its orders
            mine &= whole
        elsewhere = 0.0 if part[0] == "torque" else k.ELSEWHERE  # an angle's quantisation is no physics of the shaft
        away = beside[mine & ~own].sum()
        if not part[1]:  # what changes between visits to a point, and is not explained, may be in their mean too
            away += left[changed(own)].sum()
        remains = left[own].sum() + elsewhere * away
        strength = total / level2[mine].mean()
        if strength > best[0]:
            best = (strength, 1.0 - np.exp(-total / (2.0 * k.IMITATION**2 * remains)) if remains > 0.0 else 1.0)
    return float(best[1])
