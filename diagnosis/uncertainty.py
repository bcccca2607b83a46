"""Standard deviations of a solution's parameters, beyond the scatter of its cells.

The covariance of a least-squares fit assumes independent errors of the cells.  Three kinds of error are not:

- The residual of a curve at an operating point is the same in all its blocks.  The sandwich estimator over operating
  points (Liang and Zeger, Biometrika 73, 1986) counts each point once.
- The error of the balance (ripple, sampling of the bus) is proportional to the voltage everywhere.  A common share of
  it, parallel and perpendicular, is propagated to the coefficients.
- Another form changes the parameters.  If a freer curve, or an additional effect too small for a name, scores better,
  the change it causes is part of the uncertainty.
"""

from __future__ import annotations

import numpy as np
from scipy import stats

from fluxproof.diagnosis.fit import PER_EFFECT
from fluxproof.diagnosis.refine import TIE, point_numbers

# Relative to the voltage, and to the bus voltage in the direction of the current: rms in healthy recordings.
COMMON_U, COMMON_DC = 2e-5, 1e-5
LEAST_POINTS = 6  # least surplus of operating points over coefficients; with fewer their scatter is not significant
LEAST_DISPERSION = 0.8


class Plain:
    """The fit's own covariances {effect: (k, k)}, scaled by chi^2 per degree of freedom."""

    def __init__(self, solution, effects, nominal, reduced):
        self.solution, self.effects, self.nominal, self.reduced = solution, effects, nominal, reduced
        wider = max(reduced, LEAST_DISPERSION)
        self.covariance = {name: matrix * wider for name, matrix in solution.covariance.items()}

    def others(self) -> list[dict]:
        """Coefficients {effect: {...}} of the solution's effects in other admissible models."""
        return []

    def estimates(self, name, others):
        """Parameters {name: Estimate} of an effect; others: what ``others`` gave."""
        effect, nominal = self.effects[name], self.nominal
        out = effect.estimates(self.solution.c[name], self.covariance[name], nominal)
        own = {key: estimate.sigma for key, estimate in out.items()}
        for c in others:
            moved = effect.estimates(c[name], np.zeros((len(c[name]),) * 2), nominal)
            for key in out.keys() & moved.keys():
                shift = moved[key].value - out[key].value
                out[key].sigma = float(max(out[key].sigma, np.hypot(own[key], shift)))
        return out


class Spread(Plain):
    """Covariances of a refined solution of a search, and the models that would change its parameters."""

    def __init__(self, search, solution, reduced):
        """reduced: chi^2 per degree of freedom of the solution's residual."""
        super().__init__(solution, search.effects, search.view.nominal, reduced)
        self.search = search
        view, model = solution.view, solution.model
        self.fitter = f = search.fitter(view, [search.effects[n] for n in sorted(model.names)])
        self.carried = f.carried(model)
        self.sigma = f.sigma[f.use]
        self.columns = f.a[:, self.carried] * f.scale[self.carried]
        self.inverse = np.linalg.inv(self.columns.T @ self.columns)
        self.error = f.solve(model).residual[f.use] / self.sigma
        own = larger(self.inverse * max(reduced, LEAST_DISPERSION), self._between_points())
        self.covariance = self._by_effect(own + self._common())
        for name in model.names:
            for k in set(f.index[name][0]) - set(self.carried):
                self._hidden(name, k)

    def _between_points(self):
        """Covariance (k, k) from the differences between operating points; zero if there are too few."""
        group = point_numbers(self.solution.view)[self.fitter.cells.block[self.fitter.use]]
        names, k = np.unique(group), len(self.carried)
        if len(names) < k + LEAST_POINTS:
            return np.zeros((k, k))
        scores = np.array([self.columns[group == g].T @ self.error[group == g] for g in names])
        # With few points the scatter is uncertain: Student's quantile replaces the normal one.
        wider = (stats.t.ppf(0.975, len(names) - k) / stats.norm.ppf(0.975)) ** 2
        return self.inverse @ (scores.T @ scores) @ self.inverse * wider * len(names) / (len(names) - k)

    def _common(self):
        """Covariance (k, k) due to the common error of the balance."""
        view, f = self.solution.view, self.fitter
        u, bus = view.to_dq(view.u[:, 1:-1]), view.nominal.inverter.dc_bus_v
        along = view.i_mid / np.abs(view.i_mid).clip(0.02 * view.machine.rated_current_a)
        patterns = (COMMON_U * u, 1j * COMMON_U * u, COMMON_DC * bus * along)
        rows = np.array([self.search.projector.rows({"u": p})[f.use] / self.sigma for p in patterns]).T
        moved = self.inverse @ (self.columns.T @ rows)
        return moved @ moved.T

    def _by_effect(self, matrix):
        """A covariance of the carried columns as {effect: (k, k)} in the order of each effect's coefficients."""
        f, model, out = self.fitter, self.solution.model, {}
        place = {k: n for n, k in enumerate(self.carried)}
        index = f.columns_of(model)
        for name in model.names:
            mine = [k for k in index if f.owner[k] == name]
            out[name] = np.array([[matrix[place[a], place[b]] if a in place and b in place else 0.0 for b in mine]
                                  for a in mine])  # fmt: skip
        return out

    def _hidden(self, name, k):
        """Increase an effect's covariance for a coefficient of its formula (column k) that is collinear with others.

        At one speed, Coulomb and viscous friction are collinear: any split between them fits equally well.
        """
        f, c = self.fitter, self.solution.c[name]
        own, hidden = [n for n in f.columns_of(self.solution.model) if f.owner[n] == name], f.a[:, k]
        taken = dict(zip(self.carried, self.inverse @ (self.columns.T @ hidden), strict=True))  # of kept columns
        found = sum(c.get(f.names[n].lstrip("~"), 0.0) * f.scale[n] * f.a[:, n] for n in own)
        along = np.array([1.0 / f.scale[k] if n == k else -taken.get(n, 0.0) for n in own])
        self.covariance[name] += (hidden @ found) ** 2 * np.outer(along, along)

    def others(self) -> list[dict]:
        """Coefficients {effect: {...}} of the solution's effects in the best larger models.

        A larger model has a freer curve or one more effect, which was too small for a name.  Returned are the best of
        those that score better than the solution and the ones tied with it; an empty list if none scores better.
        """
        search, solution, model = self.search, self.solution, self.solution.model
        at = search.fitter(solution.view, search.effects.values())
        base, found = at.solve(model), []
        for other in self._larger_models(at):
            chi2, count = at.chi2(other)
            price = at.price * (count - base.count) + PER_EFFECT * (len(other) - len(model))
            gain = (base.chi2 - chi2) / max(self.reduced, LEAST_DISPERSION) - price
            if count > base.count and gain > 0.0:
                found.append((gain, other))
        best = max((gain for gain, _ in found), default=0.0)
        out = []
        for gain, other in found:
            if gain > best - TIE:
                c = at.solve(other).c
                moved = {n: {k: c[n][k] - base.c[n].get(k, 0.0) for k in c[n]} for n in model.names}
                out.append(
                    {n: {k: solution.c[n].get(k, 0.0) + v for k, v in moved[n].items()} for n in moved}
                )
        return out

    def _larger_models(self, at):
        model = self.solution.model
        able = [n for n in self.search.effects if at.index[n][0]]
        freed = [model.with_(n, True) for n in sorted(model.names - model.free)]
        return freed + [model.with_(n, bent) for n in able if n not in model.names for bent in (False, True)]


def larger(first, second):
    """A covariance that is in no direction smaller than either of two; the first one must be regular."""
    root = np.linalg.cholesky(first)
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ second @ inverse.T)
    grown = root @ vectors
    return (grown * np.maximum(values, 1.0)) @ grown.T
