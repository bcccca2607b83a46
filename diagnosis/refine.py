"""Solves a model on one view, iterating until it converges.

Measurement errors (angle, currents, delay, bus) are removed from the data and the balance is recomputed; terms that
depend on the flux use the flux that the model's magnetic effects add.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.cells import Projector, cells_of, column_of
from fluxproof.diagnosis.effect import FluxEffect, half_dead_time, rated_torque
from fluxproof.diagnosis.fit import Fitter, Model, Solution, everything, row_sigma

NOISY_TORQUE = 0.03  # of rated torque
POINT = 0.08  # of top speed and rated current: closer operating points count as one
CURVE_SHARE = 0.01  # relative error of any curve of the catalogue, as a share of its contribution to a row
MOST_EFFECTS = 4  # larger models are not accepted as an explanation
TIE = 10.0


def point_numbers(view) -> np.ndarray:
    """(b,) number of the operating point (speed, i_d, i_q) of each block of a view.

    The first block that is far from all known points starts a new one; fixed bins would split some points.
    """
    m, omega, i = view.machine, view.omega.mean(axis=1), view.i.mean(axis=1)
    top = max(float(np.abs(omega).max()), 1e-9)
    points = np.stack([omega / top, i.real / m.rated_current_a, i.imag / m.rated_current_a], axis=1)
    number, free = np.full(len(points), -1), 0
    while (number < 0).any():
        first = points[np.argmax(number < 0)]
        number[(number < 0) & (np.abs(points - first).max(axis=1) < POINT)] = free
        free += 1
    return number


def operating_points(view) -> int:
    """Number of different operating points of a view.

    Each gives two means, and an effect has two or three coefficients: more than one effect per two points would be able
    to explain anything.
    """
    return int(point_numbers(view).max()) + 1


class Refiner:
    """The linear problem of a view and the solutions refined on it."""

    def __init__(self, view, effects, train_blocks, progress=lambda text: None):
        self.most = min(MOST_EFFECTS, (operating_points(view) + 1) // 2)
        if not view.i_raw.any():  # an EMF run shows magnets only, each effect at its own harmonic orders
            self.most = MOST_EFFECTS
        view = view.replace(memo={**view.memo, "lone": self.most == 1})
        self.view, self.effects, self.progress = view, dict(effects), progress
        self.projector = Projector(view)
        self.train = train_blocks[self.projector.block]
        self.adjust = np.zeros(len(self.train))
        self._weigh()
        # The acceleration of a fast free shaft is mostly noise.  A transducer's torque is kept although an unbalanced
        # load differs from block to block.  The projector's rows are used in every fit.
        noisy = self.pure >= NOISY_TORQUE * rated_torque(view.nominal)
        measured = (view.shaft == "torque")[self.cells.block]
        self.projector.ok &= (self.cells.channel != "torque") | measured | ~noisy
        self.refined: dict[Model, Solution] = {}
        self._pose()

    def _weigh(self):
        """The view's cells, with the known ripple voltage subtracted, and their standard deviations."""
        self.cells = cells_of(self.view, self.effects.values(), self.projector)
        self.cells.y = self.cells.y - self.adjust
        self.sigma, self.pure = row_sigma(self.view, self.cells)
        self.unwidened = self.sigma  # before it is increased by the curve tolerance of the effects found

    def _pose(self):
        """The linear problem of the cells, and its residual with all effects in free form."""
        self.linear = Fitter(self.cells, self.sigma, self.train)
        chi2, count = self.linear.chi2(everything(self.cells))
        self.dispersion = max(1.0, chi2 / max(len(self.linear.y) - count, 1))

    def refine(self, model) -> Solution:
        """The model solved on data corrected for its measurement errors, with the flux of its magnetic effects."""
        if model in self.refined:
            return self.refined[model]
        record = [n for n in sorted(model.names) if self.effects[n].corrects]
        magnetic = [n for n in sorted(model.names) if isinstance(self.effects[n], FluxEffect)]
        if record or "iron_loss" in model.names:
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
            if not all(solution.c[n] for n in record):  # without current an error of the current has no column
                solution.score = np.inf
                return solution
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
        """The view with the flux that a solution's magnetic effects add and its iron loss removes."""
        psi = sum((self.effects[n].psi(view, solution.c[n]) for n in magnetic), np.zeros_like(view.i))
        more = np.array([self.effects[n].delta_l(solution.c[n]) for n in magnetic] or [(0.0, 0.0)]).sum(
            axis=0
        )
        least = -0.7 * np.array([view.machine.inductance_d_h, view.machine.inductance_q_h])
        view = view.replace(psi_extra=psi, delta_l=tuple(np.maximum(more, least)))
        if "iron_loss" in solution.c:
            view = view.replace(psi_extra=psi + self.effects["iron_loss"].psi(view, solution.c["iron_loss"]))
        return view

    def fitter(self, view, effects, free=None) -> Fitter:
        """The linear problem of a corrected view, with the known ripple voltage subtracted."""
        cells = cells_of(view, effects, self.projector, free)
        cells.y = cells.y - self.adjust
        # Smaller currents have smaller noise: otherwise dividing all by a factor would look like a better fit.
        return Fitter(cells, self.sigma * view.noise_gain, self.train, self.linear.penalty)

    def take_raw(self, solutions) -> Solution | None:
        """Subtract the voltage that a solution's effects derive from the current ripple, and solve it again.

        Effects are regressed on parabolas of the current, but the ripple acts on the machine too: an inductance that is
        wrong by a tenth leaves a tenth of the ripple voltage, which must not be taken for a harmonic.  The solution
        that then scores best is used; None if the ripple does not matter or no solution improves.
        """
        tried = []
        for solution in solutions:
            adjust = self._of_ripple(solution)
            change = np.sum(((adjust - self.adjust) / self.sigma)[self.linear.use] ** 2)
            if change < TIE:
                tried.append((solution.score, None, solution.model))
                continue
            model, view = solution.model, solution.view
            cells = cells_of(view, [self.effects[n] for n in sorted(model.names)], self.projector, model.free)
            cells.y = cells.y - adjust
            fitter = Fitter(cells, self.sigma * view.noise_gain, self.train, self.linear.penalty)
            tried.append((fitter.score(model, self.dispersion), adjust, model))
        _, adjust, model = min(tried, key=lambda entry: entry[0])
        if adjust is None:
            return None
        self.cells.y = self.cells.y + self.adjust - adjust
        self.adjust = adjust
        self.linear = Fitter(self.cells, self.sigma, self.train, self.linear.penalty)
        self.refined.clear()
        return self.refine(model)

    def _of_ripple(self, solution):
        """Rows (r,) of a solution's effects for the raw current minus those for its parabola."""
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
                if value and column_of(raw, key) and column_of(smooth, key):
                    adjust += value * (raw[column_of(raw, key)] - smooth[column_of(smooth, key)])
        return adjust

    def allow_for_curves(self, best):
        """Increase the sigma of every row by the curve tolerance of the best effects, and start again.

        A second effect must explain more than the possible curve error of a first one.
        """
        late = half_dead_time(best.c, self.view.nominal)
        if late:
            self.view = self.view.replace(late_s=late)
            self._weigh()
        variance = self.sigma**2
        variance = variance + np.where(self.cells.channel == "u", self.doubt(best)[self.cells.block], 0.0) ** 2
        for name, c in best.c.items():
            columns = self.cells.columns[name]
            rows = sum(v * columns[column_of(columns, k)] for k, v in c.items() if column_of(columns, k))
            variance = variance + (CURVE_SHARE * rows) ** 2
        self.sigma = np.sqrt(variance)
        self.refined.clear()
        if late:
            self._pose()
        else:
            self.linear = Fitter(self.cells, self.sigma, self.train)

    def doubt(self, solution) -> np.ndarray:
        """Voltage (b,) [V] of each block by which the curves of a solution's effects may be wrong."""
        parts = [self.effects[name].doubt(c, self.view) for name, c in solution.c.items()]
        return np.sqrt(sum((np.square(part) for part in parts), np.zeros(len(self.view))))

    def corrected(self, totals):
        """The view without the measurement errors given by the totals; None if these are impossible."""
        view = self.view
        for name in sorted(totals, key=lambda n: n == "sampling_skew"):
            view = view.kept_where(~view.shows(self.effects[name]), self.effects[name].corrected(view, totals[name]))
            if not (np.isfinite(view.u).all() and np.isfinite(view.i_raw).all()):
                return None
        return view

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

    def worth(self, solution, name) -> float:
        """Reduction of chi^2 by an effect of a solution."""
        return self.refine(solution.model.without(name)).chi2 - solution.chi2
