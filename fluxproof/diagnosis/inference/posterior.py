# SPDX-License-Identifier: BSD-3-Clause
"""The posterior over sets of effects."""

from __future__ import annotations

import copy
import itertools

import numpy as np

from fluxproof.diagnosis.balance.cells import voltage_level
from fluxproof.diagnosis.effects import FarStart, MeasurementError
from fluxproof.diagnosis.inference.problem import Problem, covariance_of
from fluxproof.diagnosis.inference.settle import around, fit_at, settled
from fluxproof.diagnosis.inference.setup import Setup

ROUNDS = 3
SETTLED = 12  # most linearisations of the final set
KEPT = (12, 80)  # least and most sets of one size that are grown further
EFFORT = 20000  # rows times sets of one size
CLOSE = 20.0  # log evidence below the best within which linearising a set on its own is worth the effort
RIVAL = 50.0  # log evidence below the best from which a set that does not stand may still reach it
GROWN = 3  # effects up to which all good sets are grown
MOST_EFFECTS = 6
ALIKE = 8  # best sets that are linearised on their own before the search around one of them
LEADERS = 3  # best single effects that are linearised on their own
OTHERS = 3  # sets of measurement errors, other than those of the best set, around which sets are judged too
FAR = 0.3  # of the voltage: only a larger misfit can be of an effect that is far from linear


class Posterior:
    """All sets that were judged: {names: Fit}, the best linearisation of each."""

    def __init__(self, setup: Setup, progress=lambda text: None):
        self.setup, self.progress = setup, progress
        self.fits = {}
        self.own = set()  # sets judged on their own linearisation
        self.around = set()  # sets of measurement errors around which others were judged
        self.allowed = None  # effects that a set may contain; None: all
        self.idle = frozenset()  # effects that were taken out (answer/conclude.py)
        self._search()

    def _search(self):
        first = self.setup.call(Problem, self.setup)
        able = first.able()
        self._add(first, [()])
        self._add(first, [(n,) for n in able])
        for name in able:
            if isinstance(self.setup.effects[name], MeasurementError):
                self._linearise((name,))
        far = [n for n in able if isinstance(self.setup.effects[n], FarStart) and self._approach(n)]
        for fit in sorted((f for f in self.fits.values() if len(f.names) == 1), key=lambda f: -f.value)[:LEADERS]:
            if fit.names not in self.own:
                self._linearise(fit.names)
        self._grow(first, able)
        for name in far:
            self._neighbours(around(self.setup, self.fits[(name,)]), (name,))
        # Sets that are alike before the data are corrected may differ much afterwards.
        least = self.best().value - CLOSE
        for fit in sorted(self.fits.values(), key=lambda f: -f.value)[:ALIKE]:
            if fit.names not in self.own and fit.value > least:
                self._linearise(fit.names)
        self._refine()

    def _refine(self):
        """Search around the best set until it stands."""
        known = None
        for _ in range(ROUNDS):
            best = self.best()
            if best.names == known:
                break
            known = best.names
            self.progress(f"around {', '.join(known) or 'no effect'}")
            problem = around(self.setup, best)
            if problem is None:
                break
            self._add(problem, [known], force=True)
            self._neighbours(problem, known)
            self._near(known)
            self._others(known)
            self._simpler(known)
        self._settle()

    def within(self, allowed, idle):
        """The posterior over sets of the effects ``allowed``, without those ``idle``; this one stays as it is."""
        out = copy.copy(self)
        out.allowed, out.idle = frozenset(allowed), self.idle | frozenset(idle)
        out.fits = {names: fit for names, fit in self.fits.items() if out.allowed.issuperset(names)}
        out.own = self.own & set(out.fits)
        out._refine()
        return out

    def best(self):
        return max(self.fits.values(), key=lambda f: f.value)

    def _add(self, problem, sets, force=False):
        for names in sets:
            names = tuple(sorted(names))
            if (names in self.own and not force) or not (self.allowed is None or self.allowed.issuperset(names)):
                continue
            fit = problem.fit(names)
            if not possible(fit):
                fit.value = -np.inf
            if force:
                self.own.add(names)
            self.fits[names] = fit

    def _linearise(self, names, steps=3):
        """Judge a set on its own linearisation."""
        found = settled(self.setup, self.fits[names], steps)
        if found is not None:
            self.fits[names] = found
        if found is None or not possible(found):
            self.fits[names].value = -np.inf
        self.own.add(names)

    def _approach(self, name) -> bool:
        """Whether an effect alone stands better where it was approached from one of its ``starts``."""
        cells, plain = self.setup.cells, self.fits[(name,)]
        means = (cells.channel == "u") & (cells.order == 0.0)
        if np.sum(cells.y[means] ** 2) < FAR**2 * np.sum(voltage_level(self.setup.view) ** 2):
            return False
        tried = [fit_at(self.setup, {name: c}) for c in self.setup.effects[name].starts]
        nearest = max((f for f in tried if f is not None), key=lambda f: f.value, default=None)
        fit = nearest and settled(self.setup, nearest, SETTLED)
        if fit and possible(fit) and fit.value > plain.value:
            self.fits[(name,)] = fit
        return self.fits[(name,)] is not plain

    def _grow(self, problem, able):
        wide = int(np.clip(EFFORT / max(len(problem.p.y), 1), *KEPT))
        for size in range(2, (MOST_EFFECTS if wide == KEPT[1] else GROWN) + 1):
            leaders = sorted((f for f in self.fits.values() if len(f.names) == size - 1), key=lambda f: -f.value)
            leaders = leaders[: len(able) if size == 2 else wide]
            sets = {tuple(sorted({*f.names, n})) for f in leaders for n in able if n not in f.names}
            self._add(problem, sets)

    def _errors(self, names) -> frozenset:
        """The measurement errors of a set, which are removed from the data: what is far from linear."""
        return frozenset(n for n in names if isinstance(self.setup.effects[n], MeasurementError))

    def _neighbours(self, problem, names, errors=None):
        """Judge the sets near ``names``; errors: only those with these measurement errors (None: all)."""
        able = [n for n in problem.able() if n not in names]
        less = [tuple(n for n in names if n != out) for out in names]
        more = [(*names, n) for n in able]
        swapped = [(*rest, n) for rest in less for n in able]
        # Two effects may stand for one, and one for two.
        rests = itertools.combinations(names, len(names) - 2) if len(names) > 1 else ()
        fewer = [(*rest, n) for rest in rests for n in able]
        two = [(*names, *pair) for pair in itertools.combinations(able, 2)] if len(names) <= 1 else []
        sets = [*less, *(m for m in more if len(m) <= MOST_EFFECTS), *swapped, *fewer, *two]
        self._add(problem, [s for s in sets if errors is None or self._errors(s) == errors])

    def _near(self, known):
        """Linearise close sets on their own if they correct other errors than the best one."""
        mine = self._errors(known)
        for _ in range(8):
            best = self.best()
            close = [
                f for f in self.fits.values()
                if f.names not in self.own and f.value > best.value - CLOSE and self._errors(f.names) != mine
            ]  # fmt: skip
            if not close:
                return
            self._linearise(max(close, key=lambda f: f.value).names)

    def _simpler(self, known):
        """Linearise the best set of every smaller number of effects on its own.

        An offset beside a resistance that is half wrong, say: on the linearisation of a larger set, which found other
        causes for what is not linear, the true pair may be far worse than it is.
        """
        for size in range(1, len(known)):
            sets = [f for f in self.fits.values() if len(f.names) == size]
            simple = max(sets, key=lambda f: f.value, default=None)
            if simple is not None and simple.names not in self.own and np.isfinite(simple.value):
                self._linearise(simple.names, SETTLED)

    def _others(self, known):
        """Judge sets around the best ones that correct other measurement errors.

        Where an angle is off, say, the cause beside it is judged rightly only on data whose angle is corrected, and by
        nothing else: what the best set corrects besides makes others look worse than they are.
        """
        self.around.add(self._errors(known))
        best = {}
        for fit in sorted((self.fits[n] for n in self.own), key=lambda f: -f.value):
            if np.isfinite(fit.value) and fit.stands:
                best.setdefault(self._errors(fit.names), fit)
        for errors, fit in list(best.items())[:OTHERS]:
            if errors and errors not in self.around:
                self.around.add(errors)
                problem = around(self.setup, fit)
                if problem is not None:
                    self._neighbours(problem, fit.names, errors)

    def _settle(self):
        """Judge the best set and its parts on their own linearisations until the best one stands."""
        for _ in range(MOST_EFFECTS):
            best = self.best().names
            if not best:
                return
            self._linearise(best, SETTLED)
            for out in best:
                part = tuple(n for n in best if n != out)
                fit = self.fits.get(part)
                # A part that is impossible on the linearisation of another set may be possible on its own.
                if fit is not None and not fit.stands and (part not in self.own or np.isfinite(fit.value)):
                    self._linearise(part, SETTLED)
                self._without(out)
            if self.best().names == best:
                return

    def _without(self, name):
        """Judge the best set without an effect on its own linearisation: only then is it known what the effect adds."""
        best = max((f for f in self.fits.values() if name not in f.names), key=lambda f: f.value, default=None)
        if best is not None and not best.stands and best.value > self.best().value - RIVAL:
            self._linearise(best.names, SETTLED)

    def weights(self):
        """[(probability, Fit)] of all sets, the most probable first."""
        fits = sorted(self.fits.values(), key=lambda f: -f.value)
        w = np.exp(np.array([f.value for f in fits]) - fits[0].value)
        return list(zip(w / w.sum(), fits, strict=True))

    def present(self):
        """{effect: probability of being present}."""
        out = {}
        for p, fit in self.weights():
            for n in fit.names:
                out[n] = out.get(n, 0.0) + float(p)
        return out


def possible(fit) -> bool:
    """Whether no effect of a set has an impossible size or, beyond its uncertainty, an impossible sign."""
    problem = fit.problem
    for name in fit.names:
        effect, c = problem.setup.effects[name], fit.c[name]
        if effect.too_large(c, problem.setup.view):
            return False
        if not effect.possible(c, covariance_of(fit, name, fit.cov), problem.view.nominal):
            return False
    return True
