"""The search over the operating points of a slow log: few rows, so that every set of effects is tested.

A real drive differs from its data sheet in several effects at once, and a slow log has no harmonics to separate them.
Adding one effect after another then fails, because the first ones absorb the others.  With a hundred rows, all sets of
up to MOST_EFFECTS can be scored instead, which takes a second, and the best are refined.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.answer.locate import rms
from fluxproof.diagnosis.balance.cells import column_of, voltage_level
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.inference import constants
from fluxproof.diagnosis.inference.fit import Fitter, Model, Solution, everything
from fluxproof.diagnosis.inference.refine import Refiner

MOST_EFFECTS = 6
REFINED = 40
TIE = 20.0  # margin of a tie: neighbouring rows share messages and contain less information than their number suggests
LOADED = 0.02  # of rated current
LEAST_PAIRS = 4


@dataclass
class Outcome:
    """Result of a search: the best solution, the tied ones, and the problem they were solved on.

    sigma, pure: (r,) standard deviation of every row, and the part of it that is not the error of the balance.
    """

    best: Solution
    tied: list[Solution]
    empty: Solution
    sigma: np.ndarray
    pure: np.ndarray
    train: np.ndarray
    dispersion: float


class SlowSearch:
    """Search over a SlowView; ``problem`` solves the sets; train_blocks: (b,) bool, blocks of the fit."""

    def __init__(self, view, train_blocks, progress=lambda text: None):
        self.silent = not view.i.real.any()  # the d axis never had a current
        self.effects = view.visible(CATALOGUE)
        self.view, self.progress = view, progress
        self.problem = Refiner(view, self.effects, train_blocks, sigmas, self.hide)
        self.cells, self.linear = self.problem.cells, self.problem.linear

    def run(self) -> Outcome:
        self.progress("all sets of effects")
        for model in [Model(frozenset()), *self.every_set()]:
            self.refine(model)
        best = self.large(self.problem.best())
        p = self.problem
        return Outcome(best, self.tied(best), self.refine(Model(frozenset())), p.sigma, p.pure, p.train, p.dispersion)

    def refine(self, model) -> Solution:
        return self.problem.refine(model)

    def hide(self, cells):
        """Remove columns whose d current results only from an angle error: the recording cannot verify them."""
        for name, columns in cells.columns.items():
            for key in self.effects[name].bounded:  # this search has no priors
                columns.pop(f"~{key}", None)
            if self.silent:
                for key in [k for k in columns if k.lstrip("~").startswith(self.effects[name].needs_d_current)]:
                    del columns[key]

    def every_set(self) -> list[Model]:
        """The most promising models of all sets of up to MOST_EFFECTS effects on the linear problem."""
        able = [n for n in self.effects if self.linear.index[n][0]]
        scored = []
        for size in range(1, most_effects(len(np.unique(self.view.run))) + 1):
            for names in itertools.combinations(able, size):
                scored += [(self.linear.score(m, self.problem.dispersion), m) for m in self.some_forms(names)]
        scored.sort(key=lambda entry: entry[0])
        return [m for _, m in scored[:REFINED]]

    def some_forms(self, names) -> list[Model]:
        """All core, or one of them free: two free curves would overfit so few rows."""
        names = frozenset(names)
        free = [frozenset(), *(frozenset([n]) for n in names if self.linear.index[n][1])]
        return [m for f in free if self.allowed(m := Model(names, f))]

    def allowed(self, model) -> bool:
        """Whether every absorbed effect of the model is accompanied by the free form of the absorbing one."""
        return all(name in model.free or not (set(self.effects[name].absorbs) & model.names) for name in model.names)

    def large(self, best):
        """The best model without effects below their floor of practical interest.

        Their significance is already decided by the comparison with every other set, including the one without them.
        """
        small = [n for n in best.model.names if self.effects[n].size(best.c[n], self.view.nominal) < self.floor(n)]
        for name in small:
            best = self.refine(best.model.without(name))
        if small:  # another set may explain with large effects what the small one did with its free curve
            rest = [s for s in self.problem.refined.values() if np.isfinite(s.score) and self.all_large(s)]
            best = min([best, *rest], key=lambda s: s.score)
        return best

    def all_large(self, solution) -> bool:
        """Whether every effect of a solution reaches its floor of practical interest."""
        return all(self.effects[n].size(c, self.view.nominal) >= self.floor(n) for n, c in solution.c.items())

    def floor(self, name) -> float:
        return self.effects[name].floor(self.view.nominal)

    def tied(self, best):
        """Other sets with no more effects that explain as much as the best one, each in its best form."""
        found: dict = {}
        for model, solution in self.problem.refined.items():
            if model.names == best.model.names or len(model) > len(best.model) or not model.names:
                continue
            if solution.score < best.score + TIE:
                other = found.get(model.names)
                found[model.names] = solution if other is None or solution.score < other.score else other
        return [s for s in found.values() if not any(names < s.model.names for names in found)]

    def residual(self, solution):
        """(cells, residual (r,)) of a solution on its corrected data."""
        fitter = self.problem.fitter(solution.view, [self.effects[n] for n in sorted(solution.model.names)])
        values = np.zeros(len(fitter.cells.y))
        for name, c in solution.c.items():
            if not self.effects[name].corrects:
                columns = fitter.cells.columns[name]
                values += sum(v * columns[column_of(columns, k)] for k, v in c.items() if v and column_of(columns, k))
        return fitter.cells, fitter.cells.y - values


def most_effects(points: int) -> int:
    """Largest number of effects: with few operating points, more would explain anything."""
    return min(MOST_EFFECTS, max(1, points // 2))


def sigmas(view, cells) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviation of every row (r,) [V], and the part of it seen between repetitions of an operating point.

    Without load the voltage is constant; under load there is an additional error proportional to it, and around
    changes one proportional to the change.
    """
    level, n = voltage_level(view), len(view)
    loaded = np.abs(view.i.mean(axis=1)) > LOADED * view.machine.rated_current_a
    rows = (cells.channel == "u") & (cells.order == 0)
    at = np.full((n, 2), -1)
    at[cells.block[rows], cells.part[rows]] = np.flatnonzero(rows)
    own = np.hypot(constants.SLOW_U * level, constants.SLOW_DC * view.nominal.inverter.dc_bus_v)
    own = np.hypot(own, constants.SLOW_CHANGE * view.unsteady)
    start = own[cells.block]
    rough = Fitter(cells, start, np.ones(len(cells.y), bool)).solve(everything(cells)).residual
    rough = np.where(cells.ok, rough, np.nan)[at]  # a d voltage that was not recorded has no residual
    pairs = np.flatnonzero((np.diff(view.run) == 0) & (loaded[1:] == loaded[:-1]))
    change = (rough[pairs + 1] - rough[pairs]) / np.sqrt(2)
    under = loaded[pairs]
    rest = rms(change[~under])
    share = rms(change[under] / level[pairs][under, None])
    # Without repetitions what no effect explains is noise, unless it is too large for it.
    if (~under).sum() < LEAST_PAIRS:
        rest = min(rms(rough[~loaded]), constants.SLOW_NOISE * rms(level))
    if under.sum() < LEAST_PAIRS:
        share = min(rms((rough / level[:, None].clip(1e-9))[loaded]), constants.SLOW_NOISE)
    pure = np.hypot(rest, np.where(loaded, share * level, 0.0))
    return np.hypot(pure, own)[cells.block], pure[cells.block]
