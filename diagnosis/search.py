"""Which effects explain the misfit: all small sets of effects are solved exactly and compared.

1. All sets of up to three effects, each in core and free form, are scored on the linear problem.
2. The best are refined: measurement errors (angle, currents, delay, bus) are removed from the data with the current
   estimate and the balance is recomputed, until the estimate converges.
3. Around the best refined set, effects are added, removed and exchanged until the score no longer improves.
4. An effect stays only if it improves the fit significantly against the freest form of all others and exceeds its
   uncertainty; it is named only above its floor of practical interest.
5. Sets that score nearly as well are tied: their common effects are asserted, the others form an ambiguity.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.curvature import FAMILY, labels, straight_beside_saturation
from fluxproof.diagnosis.fit import Fitter, Model, Solution
from fluxproof.diagnosis.refine import TIE
from fluxproof.diagnosis.scales import EARNS, Scales

MOST_AT_ONCE = 3
REFINED = 14
LEAST_SURPLUS = 0.012  # of L i
BESIDE_CROSS = 0.025  # of L i: the cross term of a co-energy also adds some curvature to the axes themselves
NEIGHBOURS = 7  # number of neighbours refined around the best set
SECOND_THOUGHTS = 4  # better models that are examined after a large one has been pruned
SURE = 4.0  # standard deviations above which an effect needs no further test of its gain


@dataclass
class Outcome:
    """Result of a search: the best solution, the tied ones, and the problem they were solved on."""

    best: Solution
    tied: list[Solution]
    empty: Solution
    sigma: np.ndarray
    pure: np.ndarray  # sigma without the error of the balance
    train: np.ndarray
    dispersion: float
    silent: frozenset = (
        frozenset()
    )  # effects of the best solution that are too small to be named


class Search(Scales):
    """The search over one view."""

    together = frozenset()  # an inductance and a saturation that are both present and separated by their curve

    def run(self) -> Outcome:
        """The whole search."""
        self.progress("sets of effects")
        for model in self._linear_best():
            self.refine(model)
        best = self._climbed(self._best())
        if self.take_raw(self._by_size()):
            best = self._climbed(self._best())
        if best.model.names:
            self.allow_for_curves(best)
            for model in self._linear_best():
                self.refine(model)
            self.refine(best.model)
            best = self._climbed(self._best())
        best, sure = self._labelled(self._simplified(best))
        best = self._unscaled(best)
        best = self._with_curve(self._completed(self._pruned(best)))
        tied = self._tied(best, sure)
        empty = self.refine(Model(frozenset()))
        silent = frozenset()
        if "cross_saturation" in best.model.names:
            silent = (best.model.names & set(FAMILY)) - labels(best.view, best, BESIDE_CROSS)[0]
        if self.most > 1 or not tied:
            silent |= self.nameless(best)
        said = best.model.names.union(*(s.model.names - self.nameless(s) for s in tied))
        silent |= frozenset().union(*(s.model.names for s in tied)) - said
        return Outcome(best, tied, empty, self.sigma, self.pure, self.train, self.dispersion, silent)

    def _by_size(self) -> list[Solution]:
        """The best solution of each number of effects.

        A wrong inductance turns ripple into voltage, which attracts spurious effects.
        """
        leaders = {}
        for solution in self.refined.values():
            known = leaders.get(len(solution.model))
            if np.isfinite(solution.score) and (known is None or solution.score < known.score):
                leaders[len(solution.model)] = solution
        return list(leaders.values())

    def _climbed(self, best) -> Solution:
        """The best model that is reached by additions, removals and exchanges."""
        for _ in range(4):
            self.progress(f"around {', '.join(sorted(best.model.names)) or 'no effect'}")
            self._neighbours(best)
            better = self._best()
            if better.model == best.model:
                return best
            best = better
        return best

    def allowed(self, model) -> bool:
        """Whether every absorbed effect of the model is accompanied by the free form of the absorbing one."""
        return all(
            name in model.free or not (set(self.effects[name].absorbs) & model.names) for name in model.names
        )

    def admitted(self, model) -> Model:
        """The model with those effects in free form that absorb another one of it."""
        return Model(
            model.names, model.free | {n for n in model.names if set(self.effects[n].absorbs) & model.names}
        )

    def forms(self, names):
        """The tested forms of a set: all core, each one free, all free."""
        names = frozenset(names)
        bendable = frozenset(n for n in names if self.linear.index[n][1])
        free = {frozenset(), bendable, *(frozenset([n]) for n in bendable)}
        return [m for f in free if self.allowed(m := Model(names, f))]

    def _linear_best(self):
        """The most promising models of up to MOST_AT_ONCE effects on the linear problem."""
        able = [n for n in self.effects if self.linear.index[n][0]]
        scored = []
        for size in range(1, min(MOST_AT_ONCE, self.most) + 1):
            level = []
            for names in itertools.combinations(able, size):
                level += [(self.linear.score(m, self.dispersion), m) for m in self.forms(names)]
            level.sort(key=lambda entry: entry[0])
            # If only one effect is possible, each is a different answer, and refinement may change its score much.
            count = len(level) if self.most == 1 else REFINED // 2 + 2 * (size == 1)
            scored.append([m for _, m in level[:count]])
            if size == 2 and level:  # only effects of good pairs go on to triples
                good = [m for _, m in level[:60]]
                able = [n for n in able if any(n in m.names for m in good)]
        return [m for level in scored for m in level]

    def _best(self) -> Solution:
        return min(self.refined.values(), key=lambda s: s.score)

    def _fitter_at(self, solution) -> Fitter:
        """The linear problem with all effects at the solution's corrected data."""
        return (
            self.linear if solution.view is self.view else self.fitter(solution.view, self.effects.values())
        )

    def _neighbours(self, best):
        """Refine the promising models that differ by one addition, removal, exchange or change of form."""
        at = self._fitter_at(best)
        tried = []
        names, free = best.model.names, best.model.free
        for name in names:
            self.refine(best.model.without(name))
            if at.index[name][1]:
                other = best.model.with_(name, name not in free)
                if self.allowed(other):
                    self.refine(other)
        for name in self.effects:
            if name in names or not at.index[name][0]:
                continue
            for bend in (False, True):
                grown = self.admitted(best.model.with_(name, bend))
                if len(grown) <= self.most:
                    tried.append((at.score(grown, self.dispersion), grown))
                for out in names:
                    swapped = grown.without(out)
                    tried.append((at.score(swapped, self.dispersion), swapped))
        tried.sort(key=lambda entry: entry[0])
        for score, model in [t for t in tried if self.allowed(t[1])][:NEIGHBOURS]:
            if score < best.score + 4 * TIE:
                self.refine(model)

    def _labelled(self, best) -> tuple[Solution, bool]:
        """The best model with its flux curves named by their shape, and whether the names are certain."""
        mine = best.model.names & set(FAMILY)
        if not mine:
            return best, True
        wanted, sure = labels(best.view, best, LEAST_SURPLUS)
        if "saturation" in wanted and straight_beside_saturation(self, best):
            wanted = wanted | {"inductance_q"}
        if wanted == mine:
            return best, sure
        names = (best.model.names - mine) | wanted
        # If both are present, the inductance is the linear part and the saturation's free curve the nonlinear part.
        self.together = wanted if "saturation" in wanted and len(wanted) > 1 else frozenset()
        bendable = {n for n in wanted - self.together if self.linear.index[n][1]}
        free = (best.model.free - mine) | bendable | (wanted & {"saturation"})
        solution = self.refine(Model(names, frozenset(free & names)))
        return (solution, sure) if np.isfinite(solution.score) else (best, False)

    def _pruned(self, best):
        """The best model in which every effect is significant.

        After pruning, a large model need not be the best of its size: an effect that had absorbed parts of the removed
        ones remains.
        """
        best = self._earning(best)
        curved, tried = best.model.names & set(FAMILY), {best.model}
        for _ in range(SECOND_THOUGHTS):
            better = [
                s
                for model, s in self.refined.items()
                if model not in tried and model.names and len(model) <= max(len(best.model), 1)
                if s.score < best.score - TIE and model.names & set(FAMILY) <= curved
                if model.names & self.together in (frozenset(), self.together)
            ]
            if not better:
                break
            first = min(better, key=lambda s: s.score)
            tried.add(first.model)
            other = self._earning(self._simplified(first))
            if other.score < best.score:
                best = other
        return best

    def _completed(self, best):
        """The best model with further effects that become significant after the insignificant ones were removed.

        The search may have stopped early: an effect that had absorbed several others hides them.
        """
        for _ in range(MOST_AT_ONCE):
            self._neighbours(best)
            curved = best.model.names & set(FAMILY)
            larger = [
                s
                for model, s in self.refined.items()
                if model.names > best.model.names and len(model) == len(best.model) + 1
                if s.score < best.score - TIE and model.names & set(FAMILY) <= curved
            ]
            for first in sorted(larger, key=lambda s: s.score):
                other = self._earning(first)
                if other.model.names > best.model.names and other.score < best.score - TIE:
                    best = other
                    break
            else:
                return best
        return best

    def _with_curve(self, best):
        """The best model with a free dead-time curve if it has a resistance too; verdict.py separates them."""
        if not {"dead_time", "resistance"} <= best.model.names:
            return best
        freed = self.refine(best.model.with_("dead_time", True))
        return freed if np.isfinite(freed.score) else best

    def _earning(self, best):
        """A model without its insignificant effects."""
        while best.model.names:
            at = self._fitter_at(best)
            judged = sorted(best.model.names - self.together)  # the others were decided by the shape of their curve
            weak = {n: gain for n in judged if (gain := self.gain(best, n, at)) is not None}
            if not weak:
                pair = self._idle_pair(best)
                if not pair:
                    return best
                best = self.refine(best.model.without(pair[0]).without(pair[1]))
                continue
            best = self.refine(best.model.without(min(weak, key=weak.get)))
        return best

    def _idle_pair(self, best):
        """Two effects that nearly cancel: each is significant with the other, but both together gain almost nothing."""
        for a, b in itertools.combinations(sorted(best.model.names - self.together), 2):
            less = self.refine(best.model.without(a).without(b))
            if less.chi2 - best.chi2 < 2.0 * EARNS * self.dispersion:
                return a, b
        return None

    def gain(self, solution, name, at) -> float | None:
        """Gain in chi^2 of an insignificant effect; None if it is significant and stays.

        A significant effect below its floor also stays, without a name; otherwise others would absorb it.  The gain is
        computed against the freest form of the others, on data that are not corrected for this effect.
        """
        others = solution.model.without(name).freed()
        effect = self.effects[name]
        if effect.corrects:
            rest = {n: c for n, c in solution.total.items() if n != name}
            at = self.fitter(self.corrected(rest), [self.effects[n] for n in sorted(solution.model.names)])
        without = at.chi2(others)[0]
        with_core = at.chi2(Model(others.names | {name}, others.free))[0]
        gain = (without - with_core) / self.dispersion
        if gain < EARNS:
            return gain
        c, cov = np.array(list(solution.c[name].values())), solution.covariance[name]
        wald = float(c @ np.linalg.pinv(cov) @ c) / self.dispersion
        return None if wald > SURE**2 * len(c) ** 0.5 else gain
