"""Which effects are named, which stay open, and with what confidence.

The posterior compares sets of effects.  Where much of the misfit is left, something unknown is at work, and a part of
it may look like an effect: a leftover of the rms D, lying along the columns of an effect whose contribution has the rms
A, would imitate it.  The confidence in a name is therefore the posterior of its presence times 1 - exp(-(A / D)^2 / 8):
an effect twice as large as what is left may still be an imitation, and one five times as large is not.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fluxproof.diagnosis.inference import constants as k

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
    credit = {}
    for _, fit in kept:
        for name in fit.names:
            credit[name] = max(credit.get(name, 0.0), credibility(fit, name))
    present = {n: p * credit[n] for n, p in posterior.present().items() if n in credit}
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


def credibility(fit, name) -> float:
    """Probability in (0, 1] that an effect of a fit is no imitation by what is left of the misfit."""
    p = fit.problem.p
    count = np.maximum(np.bincount(p.group, minlength=len(p.groups)), 1)
    level2 = np.bincount(p.group, p.level**2, minlength=len(p.groups)) / count
    functionals = np.array([2.0 if order == 0 else 4.0 for _, order, _ in p.groups])
    # A discrepancy within the error of the balance is what every recording has; errors of curves are seen as they are.
    wrong2 = fit.mu**2 * np.bincount(p.group, p.doubt**2, minlength=len(p.groups)) / count
    lam = _seen_discrepancy(fit)
    left = (np.where(lam > k.USUAL, lam**2 - 1.0, 0.0) * level2 + wrong2) * functionals
    owned = np.array([fit.problem.keys[n][0] == name for n in fit.take], bool)
    rows = [(p.x[:, fit.take[take]] @ fit.vector[take]) ** 2 for take in (owned, ~owned)]
    power, others = (np.bincount(p.group, x, minlength=len(p.groups)) / count * functionals for x in rows)
    # What is left where other effects explain much is rather an error of theirs.
    beside = left * left / np.maximum(left + others, 1e-300)
    best = (0.0, 1.0)

    def changed(means):
        """The groups of contrasts that belong to groups of means."""
        orders = {p.groups[n][:2] for n in np.flatnonzero(means)}
        return np.array([contrast and (channel, order) in orders for channel, order, contrast in p.groups], bool)

    whole = np.array([abs(order - round(order)) < 1e-6 for _, order, _ in p.groups])
    for part in {(channel, contrast) for channel, _, contrast in p.groups}:
        mine = np.array([(channel, contrast) == part for channel, _, contrast in p.groups])
        total = power[mine].sum()
        if total <= 0.0:
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
