"""Models that explain a recording as well as the best solution, and combinations that are equivalent to another one."""

from __future__ import annotations

import numpy as np
from scipy import stats

from fluxproof.diagnosis.curvature import FAMILY, axes_with_current
from fluxproof.diagnosis.curves import courses
from fluxproof.diagnosis.effect import ALIKE, DOUBT, sigma
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.idle import unseen_loss
from fluxproof.diagnosis.refine import TIE, Refiner, operating_points, point_numbers

LEAST_POINTS, LEAST_SPREAD = 4.0, 0.2  # operating points needed to estimate the actual error, and its least variance
# Any two of these are equivalent to any other two, except in torque.
SCALES = frozenset({"udc_gain", "current_scale", "magnet_flux"})
LONE_TIE = 30.0  # margin of a tie with a single operating point
FILTERED = 0.2  # of the rows' scatter: a change by a correction that is not evidence


class Ties(Refiner):
    """Comparison of refined solutions."""

    @staticmethod
    def scaled_alike(solution) -> bool:
        """Whether bus and all current sensors are off by the same factor, equivalent to a magnet flux error."""
        c = solution.c
        if "udc_gain" not in c or "magnet_flux" in c or not {"current_gain", "current_scale"} & set(c):
            return False
        bus, currents = c["udc_gain"]["gain"], c.get("current_gain", {}).get("common", 0.0)
        return abs(bus - currents - c.get("current_scale", {}).get("scale", 0.0)) < ALIKE * abs(bus)

    def impedance_alike(self, solution) -> bool:
        """Whether R and the inductance of each axis with current are off by the same factor: a current scale error.

        If an axis has no current, two coefficients suffice.
        """
        m, c = self.view.machine, solution.c
        inductances = {f"inductance_{axis}" for axis in axes_with_current(self.view)}
        if not inductances or solution.model.names != {"resistance"} | inductances:
            return False
        shares = [c["resistance"]["delta_r"] / m.resistance_ohm]
        shares += [c[n][f"delta_l_{n[-1]}"] / getattr(m, f"{n}_h") for n in sorted(inductances)]
        return float(np.ptp(shares)) < ALIKE * max(np.abs(shares))

    def as_good(self, best, other, margin) -> bool:
        """Whether a solution scores within a margin of the best one, given the actual errors of the rows.

        A row's standard deviation contains an upper bound for the error of the balance.  Where two explanations differ,
        the residuals at the operating points may be far smaller, and a difference in chi^2 is then more significant.

        At one operating point, means and drifts are two or three numbers, and the remaining chi^2 is scatter: a
        spurious delay averages two voltages and reduces the scatter.
        """
        if self.most == 1:
            own, rival = self._scatter(best), self._scatter(other)
            filtered = np.clip(rival - own, -FILTERED * own, FILTERED * own)
            return other.score - best.score - filtered / self.dispersion < margin
        gained = (other.chi2 - best.chi2) / self.dispersion
        return other.score - best.score + gained * (1.0 / self._spread(best, other) - 1.0) < margin

    def _scatter(self, solution) -> float:
        """The part of a solution's chi^2 that is neither a mean nor a slow drift of a functional over the blocks."""
        points = np.eye(operating_points(self.view))[point_numbers(self.view)]
        slow = np.concatenate([points, courses(self.view).T], axis=1)
        use, cells, out = np.flatnonzero(self.cells.ok & self.train), self.cells, 0.0
        error = (solution.residual / (self.sigma * solution.view.noise_gain))[use]
        _, channel = np.unique(cells.channel[use], return_inverse=True)
        kinds = np.stack([channel, cells.order[use], cells.part[use]], axis=1)
        _, kind = np.unique(kinds, axis=0, return_inverse=True)
        for k in range(kind.max() + 1):
            rows = np.flatnonzero(kind == k)
            pattern = slow[cells.block[use[rows]]] / self.sigma[use[rows], None]
            pattern = pattern / np.linalg.norm(pattern, axis=0).max()
            out += float(np.sum((error[rows] - pattern @ np.linalg.lstsq(pattern, error[rows], rcond=None)[0]) ** 2))
        return out

    def _spread(self, best, other) -> float:
        """Variance of the best residual in the direction in which another solution differs, over that of the rows.

        Residuals are first summed per operating point, since the error of the balance is the same in all its blocks.
        The result is at most one.
        """
        use = self.cells.ok & self.train
        own, rival = (s.residual[use] / (self.sigma * s.view.noise_gain)[use] for s in (best, other))
        point = point_numbers(self.view)[self.cells.block[use]]
        along, apart = (np.bincount(point, w * (rival - own)) for w in (own, rival - own))
        if not apart.sum() > 0.0:
            return 1.0
        points = apart.sum() ** 2 / np.sum(apart**2)  # effective number of points
        if points < LEAST_POINTS:
            return 1.0
        # With few points the scatter is uncertain: Student's quantile replaces the normal one.
        wider = (stats.t.ppf(0.975, points - 1.0) / stats.norm.ppf(0.975)) ** 2
        return float(np.clip(wider * np.sum(along**2) / apart.sum(), LEAST_SPREAD, 1.0))

    @staticmethod
    def _other_scales(model, other) -> bool:
        """Whether two models differ only in which two of the three scales they have."""
        pairs = model.names & SCALES, other.names & SCALES
        return len(pairs[0]) == len(pairs[1]) == 2 and model.names - SCALES == other.names - SCALES

    def small(self, solution, name) -> bool:
        """Whether an effect of a solution is below its floor of practical interest.

        It must also exceed, beyond its uncertainty, what another effect of the solution explains.
        """
        effect, nominal = self.effects[name], self.view.nominal
        shadow = effect.overshadowed(solution.c, nominal)
        if shadow:
            shadow += DOUBT * sigma(solution.covariance[name])
        return effect.size(solution.c[name], nominal) < max(effect.floor(nominal), shadow)

    def nameless(self, solution) -> frozenset:
        """Effects of a solution that are too small for a name."""
        return frozenset(n for n in solution.model.names if self.small(solution, n))

    def _tied(self, best, sure) -> list[Solution]:
        """Other models that explain as much: sets with no more effects, each large enough for a name.

        A rival containing a sub-threshold effect counts only if its named effects are a subset of the best model's.  If
        the shape of the flux curve has determined its name (``sure``), inductance and saturation are no alternatives.
        """
        silent = self.nameless(best)
        if silent == best.model.names:
            if self.most > 1:
                return []
            silent = frozenset()  # at one operating point a small effect may be a different one above its threshold
        curved = set(FAMILY) if best.model.names & set(FAMILY) else set()
        out, rest, plain = [], best.model.names - curved, []
        for model, solution in self.refined.items():
            if not np.isfinite(solution.score) or self.scaled_alike(solution):
                continue
            said, rival = best.model.names - silent, model.names - silent - self.nameless(solution)
            if rival == model.names == said:
                plain.append(solution)
            if rival == said or not rival or rival != model.names - silent and not rival < said:
                continue
            same = model.names - curved == rest and sure
            passenger = model.names - curved > rest and model.names & curved and len(best.model.names & curved) > 1
            if same or passenger or model.names == best.model.names or len(model) > len(best.model):
                continue
            margin = TIE if self.most > 1 else LONE_TIE
            if self._other_scales(best.model, model):  # the free form is then required and not chosen by its score
                margin += max(self.linear.penalty * (solution.count - best.count), 0.0)
            near = solution.score < best.score + margin or self.most == 1
            if near and model.names and self.as_good(best, solution, margin):
                if all(s.model.names != model.names for s in out):
                    out.append(solution)
        # A model that contains a tied one, or the best one without a better score, only adds a superfluous effect.
        enough = lambda s: [*out, *(p for p in plain if p.score <= s.score)]  # noqa: E731
        out = [s for s in out if not any(o.model.names < s.model.names for o in enough(s))]
        loss = self.effects.get("dead_time") if self.most == 1 else None
        return out + (unseen_loss(self.view, loss, [best, *out]) if loss else [])

    def straightened(self, solutions) -> list[Solution]:
        """Solutions with a wrong inductance of each axis instead of a saturation, if they are not among the given ones.

        At one operating point this is one more effect and therefore not tied, but only one current level was recorded.
        """
        if self.most > 1:
            return []
        straight = {f"inductance_{axis}" for axis in axes_with_current(self.view)}
        models = {Model(s.model.names - {"saturation"} | straight) for s in solutions if "saturation" in s.model.names}
        others = [self.refine(m) for m in models if all(s.model.names != m.names for s in solutions)]
        return [s for s in others if np.isfinite(s.score)]
