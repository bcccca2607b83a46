# SPDX-License-Identifier: BSD-3-Clause
"""Which reading of recording and drive file the data prefer.

Readings are judged as effects are, by the evidence for the balance that they leave: first without any effect, which is
cheap, as the balance is a sum of few terms that a reading scales,

    y = f_u u - f_R R i - f_Ld d(L_d i_d) - f_Lq d(L_q i_q) - f_psi d(psi_m)

then the best ones with the whole search of effects.  A reading has no free size, which the evidence rewards by itself:
currents in rms differ from a gain error in how exactly the factor is met.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.balance.misfit import bulge
from fluxproof.diagnosis.conventions.reading import Reading
from fluxproof.diagnosis.conventions.table import pole_pairs_for, readings_for
from fluxproof.diagnosis.effects import torque_of
from fluxproof.diagnosis.effects.constant import is_of_nameplate
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.machine import flux_terms
from fluxproof.diagnosis.inference.evidence import evidence
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import implausible, log_implausible
from fluxproof.diagnosis.inference.linearise import Rows
from fluxproof.diagnosis.inference.model import no_columns
from fluxproof.diagnosis.inference.points import condense
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.search import search
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.interpret.mistake import is_exact, is_simpler

WIDE = 6  # readings to which a second one is added
SEARCHED = 2  # readings, or pairs of them, that are judged with the whole search
KEYS = ("resistance_ohm", "inductance_d_h", "inductance_q_h", "magnet_flux_wb")


@dataclass(frozen=True)
class Judged:
    """Readings with their evidence without effects, prior included; y: (n,) what they leave, in recorded volts."""

    readings: tuple[Reading, ...]
    value: float
    y: np.ndarray


def preferred(recordings, posterior, explained, progress=lambda text: None):
    """(readings, rivals, Posterior) that the data prefer; without readings if what is documented fits best.

    An interpretation that is not met exactly, or replaces no effect (mistake.py), is rejected: the best of those that
    would fit better are rivals of what is documented.  rivals: readings that leave the same balance; posterior: of the
    effects as documented; explained: whether these explain the misfit.
    """
    setup, known = posterior.setup, posterior.best().value
    if len(np.unique(setup.points)) < k.READ_POINTS:
        return (), [], posterior
    most = len(posterior.best().names) if explained else np.inf
    absurd = implausible(posterior.best()) > 0  # a bus sensor that is off by a third, say
    able = [r for r in _all(setup.view.nominal) if r.possible(recordings)]
    able = [r for r in able if all(getattr(setup.view.machine, key) for key in r.machine)]
    terms = Terms(setup)
    if terms.excited() < 2:  # a factor on the columns is then a point of the free size of that one constant
        able = [r for r in able if r.machine or r.volts == r.currents == 1.0]
    perfect = terms.perfect()
    plain = terms.judged(())
    free = max(map(_of_any_nameplate, posterior.fits.values())) + np.log(k.CLEARLY)
    good = sorted((j for j in map(terms.judged, ((r,) for r in able)) if j.value > plain.value), key=_rank)
    good = [j for j in good if np.linalg.norm(j.y) > k.TOO_EXACT * np.linalg.norm(terms.points(0.0)[0].level)]
    two = [terms.judged((*j.readings, r)) for j in good[:WIDE] for r in able if _apart(j.readings, r)]
    singles = {j.readings[0].code: j.value for j in good}
    two = [j for j in two if j.value > max(singles.get(r.code, plain.value) for r in j.readings)]
    ranked = _without_doubles(sorted([*good, *two], key=_rank))
    best, found, rejected, most_probable = None, posterior, [], known
    for j in ranked[:SEARCHED]:
        prior = len(j.readings) * np.log(k.MISREAD)
        if max(j.value, perfect - k.ONE_EFFECT + prior) <= known:
            continue
        progress(f"interpretation: {j.readings[0].says}")
        read = setup.call(_read, setup, tuple(r.code for r in j.readings))
        if not is_simpler(j.readings, ("any",), most, absurd):  # no effect may be left beside it
            alone = fit_set(Problem(read), ()).value + prior + terms.jacobian(j.readings)
            if alone <= known:
                continue
        other = setup.call(search, read, progress)
        value = other.best().value + prior + terms.jacobian(j.readings)
        left = other.best().names
        met = is_exact(j.readings, left, setup.effects) and is_simpler(j.readings, left, most, absurd)
        # What is left beside one of several readings must have one size under all of them.
        met = met and all(is_exact((r,), left, setup.effects) for r in _rivals(j, good))
        # An exact factor is one point of what free sizes cover: what meets it within no error is no such point.
        met = met and (value > free or _is_clean(other.best()))
        if value > known and met:
            best, known, found = j, value, other
        elif value > most_probable and len(j.readings) == 1:
            rejected, most_probable = [*j.readings, *_rivals(j, good)], value
        if best is j and not other.best().names:
            break  # nothing is left that another reading could explain
    if best is None:
        return (), rejected, posterior
    return best.readings, _rivals(best, good), found


def _of_any_nameplate(fit) -> float:
    """The log posterior of a set in which any size of the nameplate's constants is as probable as a small one.

    A drive file is written by hand: beside a factor that happens to be exact, other constants are no absurd error.
    """
    effects, value = fit.problem.setup.effects, fit.value
    for name, size in zip(fit.names, fit.sizes, strict=True):
        if is_of_nameplate(effects[name]):
            value += np.log1p(size**2 / fit.problem.most[name]) - log_implausible(fit, (name,))
    return float(value)


def _is_clean(fit) -> bool:
    """Whether a set leaves a mean voltage of the usual error: only then is a factor met exactly."""
    mean = [channel == "u" and not order and not contrast for channel, order, contrast in fit.problem.p.groups]
    return bool((fit.lam[np.array(mean)] <= k.DISCREPANCY).all())


def _rivals(judged, good) -> list[Reading]:
    """The readings that leave the same balance as a single one; good: all that are better than what is documented."""
    alone = len(judged.readings) == 1
    return [j.readings[0] for j in good if alone and j.readings != judged.readings and _same(j, judged)]


def _read(setup, codes) -> Setup:
    """The setup under readings, with raw or with smooth signals changed, whichever leaves less.

    Ripple of a current is a signal, which shows that a reading is right; its noise is not.
    """
    readings = _coded(setup, codes)
    volts, amps = _product(r.volts for r in readings), _product(r.currents for r in readings)
    raw = Setup.of(setup.call(_rows_as_read, setup.rows, codes), setup.call).read_like(setup, volts, amps)
    if any(r.turn for r in readings):
        return raw
    return max((raw, raw.smoothly(setup, volts, amps)), key=lambda s: fit_set(Problem(s), ()).value)


def _rows_as_read(rows, codes) -> Rows:
    """The rows of a recording under readings."""
    view = rows.view
    for reading in _coded(rows, codes):
        # The cells stay those of the stated pole pairs, whose mechanical orders no operating point shows.
        view = dataclasses.replace(reading, pole_pairs=0).of_view(view)
    train = np.zeros(len(view), bool)
    train[rows.projector.block[rows.train]] = True
    return Rows(view, rows.effects, train)


def _all(nominal) -> list[Reading]:
    return [*readings_for(nominal), *pole_pairs_for(nominal)]


def _coded(rows, codes) -> list[Reading]:
    """The readings of a recording with these codes."""
    known = {r.code: r for r in _all(rows.view.nominal)}
    return [known[code] for code in codes]


def _rank(judged):
    return -round(judged.value, 3)  # of equals the first of the table


def _apart(readings, more) -> bool:
    """Whether a further reading concerns other quantities."""
    return not more.touches & {quantity for r in readings for quantity in r.touches}


def _same(a, b) -> bool:
    return bool(np.linalg.norm(a.y - b.y) <= k.SAME_BALANCE * np.linalg.norm(a.y) + 1e-12)


def _without_doubles(ranked) -> list[Judged]:
    """The first of those that leave the same balance."""
    out = []
    for j in ranked:
        if not any(_same(j, other) for other in out):
            out.append(j)
    return out


def _terms(rows, turn) -> dict[str, np.ndarray]:
    """{term: rows (r,)} of the nominal machine, the angle turned by ``turn`` [rad].

    The functionals are those of the documented angle for all.
    """
    view = rows.view.turned(-turn) if turn else rows.view
    exact, m = view.with_raw_current(), view.machine
    i = exact.i
    d, q, psi = flux_terms(m, i)
    columns = {
        "u": {"u": view.to_dq(view.u[:, 1:-1])},
        "r": {"u": -m.resistance_ohm * (exact.i_mid - bulge(view))},
        **{name: {"u": -view.flux(flux)} for name, flux in (("d", d), ("q", q), ("psi", psi))},
    }
    if np.isfinite(view.torque).any():
        columns |= {f"t_{n}": {"torque": -torque_of(view, f, i)} for n, f in (("d", d), ("q", q), ("psi", psi))}
    return {name: rows.projector.rows(column) for name, column in columns.items()}


class Terms:
    """The terms of one recording's balance, condensed as in the search, for each angle that a reading assumes."""

    def __init__(self, setup):
        self.setup, self.known = setup, {}
        # Measured torque and sum of the currents, and what the drive file describes beyond the terms.
        self.rest = setup.cells.y - sum(setup.call(_terms, setup.rows, 0.0).values())

    def points(self, turn):
        """(Points with the terms as columns, their names) with the angle turned by ``turn`` [rad]."""
        if turn not in self.known:
            s = self.setup
            rest = {f"rest_{c}": np.where(s.cells.channel == c, self.rest, 0.0) for c in ("u", "sum", "torque")}
            terms = s.call(_terms, s.rows, turn) | rest
            points = condense(s.grouping, s.cells.y, np.array(list(terms.values())).T, s.noise, s.level, s.load)
            self.known[turn] = points, list(terms)
        return self.known[turn]

    def judged(self, readings) -> Judged:
        """The evidence of readings without effects."""
        points, names = self.points(sum(r.turn for r in readings))
        y = points.x @ np.array([_factor(name, readings) for name in names])
        scale = np.where(self._is(points, "u"), _product(r.volts for r in readings), 1.0)
        scale = np.where(self._is(points, "sum"), _product(r.currents for r in readings), scale)
        value = self._evidence(points, y, scale) + len(readings) * np.log(k.MISREAD) + self.jacobian(readings)
        return Judged(tuple(readings), value, y / scale)

    def excited(self) -> int:
        """How many of R, L_d, L_q and psi_m make a part of the voltage that can be told from nothing."""
        points, names = self.points(0.0)
        size = dict(zip(names, np.linalg.norm(points.x[self._is(points, "u")], axis=0), strict=True))
        return sum(size[name] > k.EXCITED * size["u"] for name in ("r", "d", "q", "psi"))

    def perfect(self) -> float:
        """The evidence of a balance that is met exactly: no set of effects reaches more."""
        points, _ = self.points(0.0)
        return self._evidence(points, np.zeros(len(points.y)), np.ones(len(points.y)))

    def jacobian(self, readings) -> float:
        """Change of the log density as the recorded voltages and currents are multiplied by factors."""
        points, _ = self.points(0.0)
        volts, amps = _product(r.volts for r in readings), _product(r.currents for r in readings)
        return self._is(points, "u").sum() * np.log(volts) + self._is(points, "sum").sum() * np.log(amps)

    @staticmethod
    def _is(points, channel) -> np.ndarray:
        """(n,) bool: points of a channel."""
        return np.array([name == channel for name, _, _ in points.groups])[points.group]

    def _evidence(self, p, y, scale) -> float:
        return evidence(p.rows(y, scale), no_columns(len(y)), self.setup.prior(p), np.inf).log_evidence


def _product(factors) -> float:
    out = 1.0
    for factor in factors:
        out *= factor
    return out


def _factor(term, readings) -> float:
    """Factor of a term of the balance under readings."""
    amps = _product(r.currents for r in readings)
    volts = _product(x.volts for x in readings)
    r, d, q, psi = (_product(x.machine.get(key, 1.0) for x in readings) for key in KEYS)
    speed = _product(x.speed for x in readings)
    return {
        "u": volts, "r": r * amps, "d": d * amps * speed, "q": q * amps * speed, "psi": psi * speed,
        "t_psi": psi * amps * speed, "t_d": d * amps**2 * speed, "t_q": q * amps**2 * speed,
        "rest_u": volts, "rest_sum": amps, "rest_torque": 1.0,
    }[term]  # fmt: skip
