"""Solves a model on the operating points of a slow log, iterating until it converges.

Measurement errors (angle, currents, delay, bus) are removed from the data and the balance is recomputed; terms that
depend on the flux use the flux that the model's magnetic effects add.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.cells import Projector, cells_of
from fluxproof.diagnosis.effects.corrections import in_turn, with_flux
from fluxproof.diagnosis.effects.effect import believable
from fluxproof.diagnosis.inference.fit import Fitter, Model, Solution, everything

STEPS = 4
IMPLAUSIBLE = 20.0  # of the score, for a value outside of what its effect declares: odds of one in 20 000
UNLIMITED = 300.0  # times its floor: usual range of an effect without a ceiling


class Refiner:
    """The linear problem of a view and the solutions refined on it.

    sigmas: function of (view, cells): standard deviations of the rows, (all, without the error of the balance).
    hide: function of cells: removes columns that the recording cannot verify.
    """

    def __init__(self, view, effects, train_blocks, sigmas, hide=lambda cells: None):
        self.view, self.effects, self.hide = view, dict(effects), hide
        self.projector = Projector(view)
        self.train = train_blocks[self.projector.block]
        self.cells = cells_of(view, self.effects.values(), self.projector)
        hide(self.cells)
        self.sigma, self.pure = sigmas(view, self.cells)
        self.refined: dict[Model, Solution] = {}
        self.linear = Fitter(self.cells, self.sigma, self.train)
        chi2, count = self.linear.chi2(everything(self.cells))
        self.dispersion = max(1.0, chi2 / max(len(self.linear.y) - count, 1))

    def best(self) -> Solution:
        """The solution with the lowest score so far."""
        return min(self.refined.values(), key=lambda s: s.score)

    def refine(self, model) -> Solution:
        """The model solved on data corrected for its measurement errors, with the flux of its magnetic effects."""
        if model in self.refined:
            return self.refined[model]
        record = [n for n in sorted(model.names) if self.effects[n].corrects]
        if record or any(self.effects[n].takes_flux for n in model.names):
            solution = self._iterated(model, record)
        else:
            solution = self.linear.solve(model, self.dispersion)
            solution.view = self.view
        solution.score += self.unusual(solution) if self.plausible(solution) else np.inf
        self.refined[model] = solution
        return solution

    def _iterated(self, model, record):
        totals: dict = {n: {} for n in record}
        view, mine = self.view, [self.effects[n] for n in sorted(model.names)]
        for step in range(STEPS):
            fitter = self.linear if step == 0 else self.fitter(view, mine, model.free)
            solution = fitter.solve(model, self.dispersion)
            if not all(solution.c[n] for n in record):  # without current an error of the current has no column
                solution.score = np.inf
                return solution
            small = True
            for n in record:
                for key, value in solution.c[n].items():
                    totals[n][key] = totals[n].get(key, 0.0) + value
                spread = np.sqrt(np.maximum(np.diag(solution.covariance[n]), 0.0))
                small &= all(abs(v) <= 0.1 * s for v, s in zip(solution.c[n].values(), spread, strict=True))
            if step == STEPS - 1 or (small and step > 0):
                break
            corrected = self.corrected(totals)
            if corrected is None:
                solution.score = np.inf
                break
            view = with_flux(corrected, self.effects, solution.c)
        for n in record:
            solution.c[n] = dict(totals[n])
        solution.view, solution.total = view, totals
        return solution

    def fitter(self, view, effects, free=None) -> Fitter:
        """The linear problem of a corrected view."""
        cells = cells_of(view, effects, self.projector, free)
        self.hide(cells)
        return Fitter(cells, self.sigma, self.train, self.linear.penalty)

    def corrected(self, totals):
        """The view without the measurement errors given by the totals; None if these are impossible."""
        view = in_turn(self.view, self.effects, totals)
        return view if np.isfinite(view.u).all() and np.isfinite(view.i_raw).all() else None

    def unusual(self, solution) -> float:
        """Twice the negative log prior of the sizes, as in the search of fast logs: it falls beyond usual ones.

        A sum of absurd effects may fit as well as the true ones: each value that its effect calls implausible costs.
        """
        nominal, total = self.view.nominal, 0.0
        for name, c in solution.c.items():
            effect = self.effects[name]
            floor, ceiling = effect.floor(nominal), effect.ceiling(nominal)
            most = max(ceiling / floor, 2.0) if np.isfinite(ceiling) else UNLIMITED
            total += 2.0 * float(np.log1p((effect.size(c, nominal) / floor) ** 2 / most))
            found = effect.estimates(c, solution.covariance[name], nominal)
            total += IMPLAUSIBLE * sum(not believable(e, effect.plausible[k], nominal) for k, e in found.items()
                                       if k in effect.plausible)  # fmt: skip
        return total

    def plausible(self, solution) -> bool:
        """Whether no effect has an impossible size or, beyond its uncertainty, an impossible sign."""
        for name in solution.model.names:
            effect = self.effects[name]
            if not solution.c[name]:  # without current an effect of the current has no column
                return False
            if effect.too_large(solution.c[name], self.view):
                return False
            if not effect.possible(solution.c[name], solution.covariance[name], self.view.nominal):
                return False
        return True
