"""What explains a recording as well as the best solution does, and what is no other explanation at all."""

from __future__ import annotations

import numpy as np
from scipy import stats

from fluxproof.diagnosis.curvature import FAMILY, axes_told
from fluxproof.diagnosis.curves import courses
from fluxproof.diagnosis.effect import ALIKE, DOUBT, sigma
from fluxproof.diagnosis.fit import Model, Solution
from fluxproof.diagnosis.idle import unseen_loss
from fluxproof.diagnosis.refine import TIE, Refiner, operating_points, point_numbers

LEAST_POINTS, LEAST_SPREAD = 4.0, 0.2  # operating points that say how large errors really are; no smaller than that
SCALES = frozenset({"udc_gain", "current_scale", "magnet_flux"})  # any two of them are any other two, but for torque
LONE_TIE = 30.0  # margin of a tie where one operating point is all there is
FILTERED = 0.2  # of the rows' scatter: so much a correction of the record may take or add and say nothing


class Ties(Refiner):
    """Refined solutions against each other."""

    @staticmethod
    def scaled_alike(solution) -> bool:
        """Whether the bus and all current sensors are off by one factor: then neither is, but the magnets are."""
        c = solution.c
        if "udc_gain" not in c or "magnet_flux" in c or not {"current_gain", "current_scale"} & set(c):
            return False
        bus, currents = c["udc_gain"]["gain"], c.get("current_gain", {}).get("common", 0.0)
        return abs(bus - currents - c.get("current_scale", {}).get("scale", 0.0)) < ALIKE * abs(bus)

    def impedance_alike(self, solution) -> bool:
        """Whether ohms and every inductance that a current shows are off by one factor: then the current sensors are.

        Where an axis carries no current, that takes two coefficients only.
        """
        m, c = self.view.machine, solution.c
        inductances = {f"inductance_{axis}" for axis in axes_told(self.view)}
        if not inductances or solution.model.names != {"resistance"} | inductances:
            return False
        shares = [c["resistance"]["delta_r"] / m.resistance_ohm]
        shares += [c[n][f"delta_l_{n[-1]}"] / getattr(m, f"{n}_h") for n in sorted(inductances)]
        return float(np.ptp(shares)) < ALIKE * max(np.abs(shares))

    def as_good(self, best, other, margin) -> bool:
        """Whether a solution scores within a margin of the best where the rows' errors are as small as they turn out.

        A row's standard deviation holds a share for the balance itself which is a bound: where two explanations differ,
        the residuals at the operating points may be far smaller, and a difference in chi^2 then says more.

        At one operating point what stands there, or drifts, is two or three numbers, and the rows' scatter the rest of
        chi^2: a delay that is no delay averages two voltages and leaves less noise.
        """
        if self.most == 1:
            own, rival = self._scatter(best), self._scatter(other)
            filtered = np.clip(rival - own, -FILTERED * own, FILTERED * own)
            return other.score - best.score - filtered / self.dispersion < margin
        gained = (other.chi2 - best.chi2) / self.dispersion
        return other.score - best.score + gained * (1.0 / self._spread(best, other) - 1.0) < margin

    def _scatter(self, solution) -> float:
        """chi^2 of a solution that is neither a mean nor a slow course of one functional over the blocks."""
        points = np.eye(operating_points(self.view))[point_numbers(self.view)]
        slow = np.concatenate([points, courses(self.view).T], axis=1)
        use, cells, out = np.flatnonzero(self.cells.ok & self.train), self.cells, 0.0
        error = (solution.residual / (self.sigma * solution.view.noise_gain))[use]
        _, channel = np.unique(cells.channel[use], return_inverse=True)
        kinds = np.stack([channel, cells.order[use], cells.part[use]], axis=1)
        _, kind = np.unique(kinds, axis=0, return_inverse=True)
        for k in range(kind.max() + 1):
            rows = np.flatnonzero(kind == k)
            stands = slow[cells.block[use[rows]]] / self.sigma[use[rows], None]
            stands = stands / np.linalg.norm(stands, axis=0).max()
            out += float(np.sum((error[rows] - stands @ np.linalg.lstsq(stands, error[rows], rcond=None)[0]) ** 2))
        return out

    def _spread(self, best, other) -> float:
        """Variance of what the best solution leaves along where another one differs, over that of the rows.

        Summed by operating point first, as what the balance is off by is the same in all blocks of one; at most one.
        """
        use = self.cells.ok & self.train
        own, rival = (s.residual[use] / (self.sigma * s.view.noise_gain)[use] for s in (best, other))
        point = point_numbers(self.view)[self.cells.block[use]]
        along, apart = (np.bincount(point, w * (rival - own)) for w in (own, rival - own))
        if not apart.sum() > 0.0:
            return 1.0
        points = apart.sum() ** 2 / np.sum(apart**2)  # so many that count
        if points < LEAST_POINTS:
            return 1.0
        # Few of them know their own scatter badly: the quantile of Student's distribution for the normal one.
        wider = (stats.t.ppf(0.975, points - 1.0) / stats.norm.ppf(0.975)) ** 2
        return float(np.clip(wider * np.sum(along**2) / apart.sum(), LEAST_SPREAD, 1.0))

    @staticmethod
    def _other_scales(model, other) -> bool:
        """Whether two models differ only in which two of the three scales they have."""
        pairs = model.names & SCALES, other.names & SCALES
        return len(pairs[0]) == len(pairs[1]) == 2 and model.names - SCALES == other.names - SCALES

    def small(self, solution, name) -> bool:
        """Whether an effect of a solution is below what anybody would act on.

        What another effect makes by itself must be exceeded beyond doubt.
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
        """Other models that explain as much: other sets of no more effects, each large enough for a name.

        One with an effect that is not counts where it has only names of the best one: the others need not be there.
        Where the shape of the flux's curve has settled its name (``sure``), that is no difference.
        """
        silent = self.nameless(best)
        if silent == best.model.names:
            if self.most > 1:
                return []
            silent = frozenset()  # at one operating point what is too small may be something else that is not
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
            if self._other_scales(best.model, model):  # then a form is free because it must be, and not by its merit
                margin += max(self.linear.price * (solution.count - best.count), 0.0)
            near = solution.score < best.score + margin or self.most == 1
            if near and model.names and self.as_good(best, solution, margin):
                if all(s.model.names != model.names for s in out):
                    out.append(solution)
        # A model that holds a tied one, or what the best one says and scores no better, is that one with a passenger.
        enough = lambda s: [*out, *(p for p in plain if p.score <= s.score)]  # noqa: E731
        out = [s for s in out if not any(o.model.names < s.model.names for o in enough(s))]
        loss = self.effects.get("dead_time") if self.most == 1 else None
        return out + (unseen_loss(self.view, loss, [best, *out]) if loss else [])

    def straightened(self, solutions) -> list[Solution]:
        """Solutions with a wrong inductance of each axis in place of a saturation, where they are not among these.

        At one operating point that is one effect more and therefore not tied, but no other level of current was seen.
        """
        if self.most > 1:
            return []
        straight = {f"inductance_{axis}" for axis in axes_told(self.view)}
        models = {Model(s.model.names - {"saturation"} | straight) for s in solutions if "saturation" in s.model.names}
        others = [self.refine(m) for m in models if all(s.model.names != m.names for s in solutions)]
        return [s for s in others if np.isfinite(s.score)]
