"""Which effects explain the misfit: every small set of them, solved exactly, against each other.

1. All sets of up to three effects, each in core and free form, are scored on the linear problem.
2. The best are refined: errors of the record (angle, currents, delay, bus) are taken off the data with the
   estimate so far and the balance is made anew, until the estimate stands.
3. Around the best refined set, effects are added, removed and exchanged until nothing scores better.
4. An effect stays only if it earns its place beside the freest form of all others, is larger than an
   engineer's floor and than its own uncertainty.
5. What scores nearly as well is tied: what all tied sets share is asserted, the rest is an ambiguity.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from diagnosis.effect import FluxEffect
from diagnosis.cells import Projector, cells_of
from diagnosis.curvature import FAMILY, labels
from diagnosis.fit import Fitter, Model, Solution, everything, rated_torque, row_sigma

MOST_AT_ONCE = 3
NOISY_TORQUE = 0.03  # of rated torque
MOST_EFFECTS = 4  # more at once is no explanation
REFINED = 14
SCALES = frozenset({"udc_gain", "current_scale", "magnet_flux"})
SAME_SCALE = 0.03  # of what is explained: so much may be lost by one scale in place of two
LEAST_SURPLUS, BESIDE_CROSS = (
    0.012,
    0.025,
)  # of L i: a co-energy's cross term bends the axes themselves a little
POINT = 0.12  # of top speed and rated current: closer operating points are one
NEIGHBOURS = 7  # refined around a best set
TIE = 10.0
CURVE_SHARE = 0.01  # of what an effect contributes to a row: no curve of the catalogue fits a real one better
EARNS = 30.0  # gain in chi^2 over dispersion that an effect must bring beside the freest form of the others
SURE = 4.0  # sizes of its own standard deviation


@dataclass
class Outcome:
    """What the search found: the best solution, what is tied with it, and the problem it was solved on."""

    best: Solution
    tied: list[Solution]
    empty: Solution
    sigma: np.ndarray
    pure: np.ndarray  # sigma without the balance's own share
    train: np.ndarray
    dispersion: float
    silent: frozenset = frozenset()  # effects of the best solution that are too small to be named beside the others


def operating_points(view) -> int:
    """Number of different steady points (speed, i_d, i_q) of a view; each carries two means to explain."""
    m, omega, i = view.machine, view.omega.mean(axis=1), view.i.mean(axis=1)
    top = max(float(np.abs(omega).max()), 1e-9)
    points = np.stack([omega / top, i.real / m.rated_current_a, i.imag / m.rated_current_a], axis=1)
    return len(np.unique(np.round(points / POINT), axis=0))


class Search:
    """One search over one view."""

    def __init__(self, view, effects, train_blocks, progress=lambda text: None):
        self.view, self.effects, self.progress = view, dict(effects), progress
        self.projector = Projector(view)
        self.cells = cells_of(view, self.effects.values(), self.projector)
        self.sigma, self.pure = row_sigma(view, self.cells)
        # The acceleration of a fast free shaft is all noise; the projector's rows are those of every fit.
        self.projector.ok &= (self.cells.channel != "torque") | (
            self.pure < NOISY_TORQUE * rated_torque(view)
        )
        self.train = train_blocks[self.cells.block]
        self.linear = Fitter(self.cells, self.sigma, self.train)
        self.most = min(MOST_EFFECTS, max(1, operating_points(view) - 1))
        self.refined: dict[Model, Solution] = {}
        self.adjust = np.zeros(len(self.cells.y))
        chi2, count = self.linear.chi2(everything(self.cells))
        self.dispersion = max(1.0, chi2 / max(len(self.linear.y) - count, 1))

    def run(self) -> Outcome:
        """The whole search."""
        self.progress("sets of effects")
        for model in self._linear_best():
            self.refine(model)
        best = self._climbed(self._best())
        if self.take_raw(best):
            self.refine(best.model)
            best = self._climbed(self._best())
        if best.model.names:
            self.allow_for_curves(best)
            for model in self._linear_best():
                self.refine(model)
            self.refine(best.model)
            best = self._climbed(self._best())
        best, sure = self._labelled(self._simplified(best))
        best = self._pruned(best)
        tied = self._tied(best, sure)
        empty = self.refine(Model(frozenset()))
        silent = frozenset()
        if "cross_saturation" in best.model.names:
            silent = (best.model.names & set(FAMILY)) - labels(best.view, best, BESIDE_CROSS)[0]
        return Outcome(best, tied, empty, self.sigma, self.pure, self.train, self.dispersion, silent)

    def allow_for_curves(self, best):
        """Widen every row by a share of what the best effects contribute to it, and start anew.

        A second effect must explain more than a first one's curve may be off.
        """
        variance = self.sigma**2
        for name, c in best.c.items():
            columns = self.cells.columns[name]
            rows = sum(v * columns[k if k in columns else f"~{k}"] for k, v in c.items())
            variance = variance + (CURVE_SHARE * rows) ** 2
        self.sigma = np.sqrt(variance)
        self.linear = Fitter(self.cells, self.sigma, self.train)
        self.refined.clear()

    def _climbed(self, best) -> Solution:
        """The best model that additions, removals and exchanges lead to."""
        for _ in range(4):
            self.progress(f"around {', '.join(sorted(best.model.names)) or 'no effect'}")
            self._neighbours(best)
            better = self._best()
            if better.model == best.model:
                return best
            best = better
        return best

    def allowed(self, model) -> bool:
        """Whether an absorbed effect stands only beside the free form of what absorbs it."""
        return all(
            name in model.free or not (set(self.effects[name].absorbs) & model.names) for name in model.names
        )

    def forms(self, names):
        """The forms in which a set is tried: all core, each one free, all free."""
        names = frozenset(names)
        bendable = frozenset(n for n in names if self.linear.index[n][1])
        free = {frozenset(), bendable, *(frozenset([n]) for n in bendable)}
        return [m for f in free if self.allowed(m := Model(names, f))]

    def plausible(self, solution) -> bool:
        """No effect has a size or, beyond doubt, a sign that its physics rules out."""
        for name in solution.model.names:
            effect = self.effects[name]
            if effect.size(solution.c[name], self.view.nominal) > effect.ceiling(self.view.nominal):
                return False
            if effect.positive:
                c, cov = solution.c[name], solution.covariance[name]
                if sum(c.values()) < -2.0 * np.sqrt(max(cov.sum(), 0.0)):
                    return False
        return True

    def _linear_best(self):
        """The most promising models of up to MOST_AT_ONCE effects on the linear problem."""
        able = [n for n in self.effects if self.linear.index[n][0]]
        scored = []
        for size in range(1, min(MOST_AT_ONCE, self.most) + 1):
            level = []
            for names in itertools.combinations(able, size):
                level += [(self.linear.score(m, self.dispersion), m) for m in self.forms(names)]
            level.sort(key=lambda entry: entry[0])
            scored.append([m for _, m in level[: REFINED // 2 + 2 * (size == 1)]])
            if size == 2 and level:  # only effects of good pairs go on to triples
                good = [m for _, m in level[:60]]
                able = [n for n in able if any(n in m.names for m in good)]
        return [m for level in scored for m in level]

    def refine(self, model) -> Solution:
        """The model solved with its errors of the record taken off the data, and with the flux that it says."""
        if model in self.refined:
            return self.refined[model]
        record = [n for n in sorted(model.names) if self.effects[n].corrects]
        magnetic = [n for n in sorted(model.names) if isinstance(self.effects[n], FluxEffect)]
        if record or (magnetic and "iron_loss" in model.names):
            solution = self._iterated(model, record, magnetic)
        else:
            solution = self.linear.solve(model, self.dispersion)
            solution.view = self.view
        if not self.plausible(solution):
            solution.score = np.inf
        self.refined[model] = solution
        return solution

    def _iterated(self, model, record, magnetic):
        totals: dict = {n: {} for n in record}
        view, mine = self.view, [self.effects[n] for n in sorted(model.names)]
        for step in range(4):
            fitter = self.linear if step == 0 else self.fitter(view, mine, model.free)
            solution = fitter.solve(model, self.dispersion)
            small = True
            for n in record:
                for key, value in solution.c[n].items():
                    totals[n][key] = totals[n].get(key, 0.0) + value
                spread = np.sqrt(np.maximum(np.diag(solution.covariance[n]), 0.0))
                small &= all(abs(v) <= 0.1 * s for v, s in zip(solution.c[n].values(), spread, strict=True))
            if step == 3 or (small and step > 0):
                break
            corrected = self.corrected(totals)
            if corrected is None:
                solution.score = np.inf
                break
            view = self.with_flux(corrected, magnetic, solution)
        for n in record:
            solution.c[n] = dict(totals[n])
        solution.view, solution.total = view, totals
        return solution

    def with_flux(self, view, magnetic, solution):
        """The view that knows of the flux which the magnetic effects of a solution add."""
        if not magnetic:
            return view
        psi = sum(self.effects[n].psi(view, solution.c[n]) for n in magnetic)
        more = np.array([self.effects[n].delta_l(solution.c[n]) for n in magnetic]).sum(axis=0)
        least = -0.7 * np.array([view.machine.inductance_d_h, view.machine.inductance_q_h])
        return view.replace(psi_extra=psi, delta_l=tuple(np.maximum(more, least)))

    def fitter(self, view, effects, free=None) -> Fitter:
        """The linear problem of a corrected view, with what is known of raw currents taken off."""
        cells = cells_of(view, effects, self.projector, free)
        cells.y = cells.y - self.adjust
        # Smaller currents have smaller noise: without this, dividing all by one factor would pass for a better fit.
        return Fitter(cells, self.sigma * view.noise_gain, self.train, self.linear.price)

    def take_raw(self, solution) -> bool:
        """Take off what the solution's terms make of the raw current beside its parabola; whether that mattered.

        Terms are regressed on parabolas of the current, but the machine saw its ripple too: an inductance that
        is wrong by a tenth leaves a tenth of the ripple's voltage, which must not pass for a harmonic.
        """
        adjust = np.zeros(len(self.cells.y))
        rough = solution.view.with_raw_current()
        for name, c in solution.c.items():
            effect = self.effects[name]
            if effect.corrects or effect.smoothed or name in ("friction", "cogging"):
                continue
            smooth, raw = (
                cells_of(v, [effect], self.projector).columns[name] for v in (solution.view, rough)
            )
            for key, value in c.items():
                if value:
                    k = key if key in raw else f"~{key}"
                    adjust += value * (raw[k] - smooth[k])
        change = np.sum(((adjust - self.adjust) / self.sigma)[self.linear.use] ** 2)
        if change < TIE:
            return False
        self.cells.y = self.cells.y + self.adjust - adjust
        self.adjust = adjust
        self.linear = Fitter(self.cells, self.sigma, self.train, self.linear.price)
        self.refined.clear()
        return True

    def corrected(self, totals):
        """The view without the errors of the record that the totals stand for; None where they make no sense."""
        view = self.view
        for name in sorted(totals, key=lambda n: n == "sampling_skew"):
            view = self.effects[name].corrected(view, totals[name])
            if not (np.isfinite(view.u).all() and np.isfinite(view.i_raw).all()):
                return None
        return view

    def _best(self) -> Solution:
        return min(self.refined.values(), key=lambda s: s.score)

    def _fitter_at(self, solution) -> Fitter:
        """The linear problem with all effects at the solution's corrected data."""
        return (
            self.linear if solution.view is self.view else self.fitter(solution.view, self.effects.values())
        )

    def _neighbours(self, best):
        """Refine what lies one addition, removal, exchange or change of form away and promises something."""
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
                grown = best.model.with_(name, bend)
                if len(grown) <= self.most:
                    tried.append((at.score(grown, self.dispersion), grown))
                for out in names:
                    swapped = grown.without(out)
                    tried.append((at.score(swapped, self.dispersion), swapped))
        tried.sort(key=lambda entry: entry[0])
        for score, model in [t for t in tried if self.allowed(t[1])][:NEIGHBOURS]:
            if score < best.score + 4 * TIE:
                self.refine(model)

    def _simplified(self, best) -> Solution:
        """The best model with two scales that amount to a third one taken for that.

        All of (u_dc, current, magnets) scaled alike is no change at all, so any two of them alike are the third.
        """
        pair = best.model.names & SCALES
        if len(pair) != 2:
            return best
        (third,) = SCALES - pair
        explained = self.refine(Model(frozenset())).chi2 - best.chi2
        rest = Model(best.model.names - pair, best.model.free - pair)
        singles = [self.refine(rest.with_(third, bend)) for bend in (False, True)]
        single = min(singles, key=lambda s: s.score)
        return single if single.chi2 - best.chi2 < SAME_SCALE * explained else best

    def _labelled(self, best) -> tuple[Solution, bool]:
        """The best model with its curves of flux over current called by their shape, and whether that is sure."""
        mine = best.model.names & set(FAMILY)
        if not mine:
            return best, True
        wanted, sure = labels(best.view, best, LEAST_SURPLUS)
        if wanted == mine:
            return best, sure
        names = (best.model.names - mine) | wanted
        free = (best.model.free - mine) | {n for n in wanted if self.linear.index[n][1]}
        if "saturation" in wanted:
            free |= {"saturation"}
        return self.refine(Model(names, frozenset(free & names))), sure

    def _pruned(self, best):
        """The best model without effects that do not earn their place."""
        while best.model.names:
            at = self._fitter_at(best)
            weak = {n: gain for n in sorted(best.model.names) if (gain := self.gain(best, n, at)) is not None}
            if not weak:
                pair = self._idle_pair(best)
                if not pair:
                    return best
                best = self.refine(best.model.without(pair[0]).without(pair[1]))
                continue
            best = self.refine(best.model.without(min(weak, key=weak.get)))
        return best

    def _idle_pair(self, best):
        """Two effects that all but cancel: each is needed beside the other, both together bring next to nothing."""
        for a, b in itertools.combinations(sorted(best.model.names), 2):
            less = self.refine(best.model.without(a).without(b))
            if less.chi2 - best.chi2 < 2.0 * EARNS * self.dispersion:
                return a, b
        return None

    def gain(self, solution, name, at) -> float | None:
        """What a weak effect brings to chi^2; None where it is large, sure and needed enough to stay.

        Needed: beside the freest form of the others, on data that are not freed of this effect's error.
        """
        others = solution.model.without(name).freed()
        effect = self.effects[name]
        if effect.corrects:
            rest = {n: c for n, c in solution.total.items() if n != name}
            at = self.fitter(self.corrected(rest), [self.effects[n] for n in sorted(solution.model.names)])
        without = at.chi2(others)[0]
        with_core = at.chi2(Model(others.names | {name}, others.free))[0]
        gain = (without - with_core) / self.dispersion
        size = effect.size(solution.c[name], self.view.nominal)
        if gain < EARNS or size < effect.floor(self.view.nominal):
            return gain
        c, cov = np.array(list(solution.c[name].values())), solution.covariance[name]
        wald = float(c @ np.linalg.pinv(cov) @ c) / self.dispersion
        return None if wald > SURE**2 * len(c) ** 0.5 else gain

    def worth(self, solution, name) -> float:
        """chi^2 that an effect of a solution takes away."""
        return self.refine(solution.model.without(name)).chi2 - solution.chi2

    def _tied(self, best, sure) -> list[Solution]:
        """Other models that explain as much: other sets of no more effects.

        Where the shape of the flux's curve has settled its name (``sure``), that is no difference.
        """
        settled = set(FAMILY) if sure and best.model.names & set(FAMILY) else set()
        out = []
        for model, solution in self.refined.items():
            if model.names - settled == best.model.names - settled or len(model) > len(best.model):
                continue
            if solution.score < best.score + TIE and model.names:
                if all(s.model.names != model.names for s in out):
                    out.append(solution)
        # A model that holds another tied one is that one with a passenger.
        return [s for s in out if not any(o.model.names < s.model.names for o in out)]
