# SPDX-License-Identifier: BSD-3-Clause
"""One operating point: what drifts while it is held, and what a single point cannot separate.

At one point a constant misfit is two numbers, which every effect with two coefficients explains.  Only its change over
time is evidence: the mean over time is subtracted from the misfit and from every column, after which an effect that
does not drift has no columns left.  Magnets change the voltage along j omega, the winding along the current, which are
the same direction without i_d; a recorded winding temperature separates them by its change over time.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.balance.cells import cells_of
from fluxproof.diagnosis.balance.holdout import holdout_blocks
from fluxproof.diagnosis.balance.orders import at_order
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.decide.constant_misfit import explaining, resolution
from fluxproof.diagnosis.decide.decision import CONSTANT, SIZELESS, Basis, Decision, OnePoint, Withheld
from fluxproof.diagnosis.decide.locate import evidence, locate
from fluxproof.diagnosis.decide.sized import has_size
from fluxproof.diagnosis.decide.verdict import kind_of_one_point
from fluxproof.diagnosis.effects.course import moved
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import BestFit, Estimate, Fit, NamedEffect, Remainder
from fluxproof.diagnosis.inference.drift_fit import (
    best_sets,
    centred_cells,
    drifts,
    fitted,
    fuller,
    row_sigmas,
    with_copper,
)
from fluxproof.diagnosis.inference.least_squares import Fitter


def conclude_one_point(view) -> Decision:
    """The decision on the drift at the only operating point of a SlowView; a constant misfit is an ambiguity."""
    effects = view.visible(CATALOGUE)
    cells = cells_of(view, effects.values())
    raw = at_order(cells, cells.y, 0.0)
    centred, long = centred_cells(cells), len(view) >= k.LEAST_MEANS and view.span_s > 0.0
    drifting = [n for n, effect in effects.items() if long and drifts(cells, centred, n, effect)]
    sigma = row_sigmas(view, cells, raw)
    held = holdout_blocks(view) & long
    fitter = Fitter(centred, sigma, (cells.order == 0) & (cells.channel == "u") & ~held[cells.block])
    best, tied = best_sets(fitter, effects, drifting, view)
    constant = complex(np.nanmean(raw - fitted(cells, best)))
    off = abs(constant) > resolution(view)
    alone = explaining(view, cells, effects, drifting, constant) if off else ()
    point = OnePoint(constant, off, tuple(e.name for e in alone), long)
    drift = _fit(cells, centred.y, best.residual, sigma, held) if long else _spread(raw - constant * off, sigma)
    drifted, open_ = _sorted_out(best, tied, effects, view)
    wider = fuller(fitter, best, effects, drifting, view) + with_copper(fitter, best, cells, view)
    named = {n: _named(n, effects[n], best, wider, fitter, view) for n in drifted}
    sized = tuple(n for n in drifted if has_size(named[n].parameters, effects[n], best.c[n], view.nominal))
    names, groups, beside, kind, fit = _ruled((sized, open_), best, drift, point, view)
    return Decision(
        kind,
        effects=tuple(named[n] for n in names),
        ambiguity=groups,
        alternatives=tuple(e for e in alone if any(e.name in g for g in groups)),
        best_fit=_only_one(alone, view, point, fit, len(effects)) if kind == "unexplained" else None,
        withheld=(
            *(Withheld(n, CONSTANT) for n in beside),
            *(Withheld(n, SIZELESS) for n in drifted if n not in sized),
        ),
        location=locate(view, cells, sigma),
        fit=fit,
        explained_share=fit.explained_share if kind != "no_mismatch" else None,
        remainder=_remainder(fit) if kind in ("partly_explained", "unexplained") else (),
        evidence=evidence(view, (cells, centred.y), (cells, best.residual), sigma, held),
        basis=Basis(view, held, one_point=point),
    )


def _ruled(found, best, drift: Fit, point: OnePoint, view):
    """(names, groups, names withheld, verdict, fit of drift and constant) by the rules, in their order.

    found: (names, groups) of the drift; drift: the fit of the drift alone.
    """
    known = point.off and len(point.candidates) > 1  # by what one of them explains
    left_over = best.chi2 > k.LEFTOVER * max(best.rows - best.count, 1) and drift.share_left > k.FLOOR_SHARE
    unclear = _is_unclear(found[0], left_over, drift)
    names, groups = ((), ()) if unclear else found
    if known and not unclear:
        groups = (*groups, point.candidates)
    quiet = not unclear and not point.off and drift.train_before < max(2.0 * drift.noise_floor, resolution(view))
    fit = _with_constant(drift, abs(point.constant) * point.off, known)
    names, groups, beside = _beside_constant(names, groups, point.off and not known, fit)
    kind = kind_of_one_point(names, groups, left_over or (point.off and not known), quiet)
    if kind == "unexplained":  # nothing is named, so that the whole misfit is left
        fit = replace(fit, train_after=fit.train_before, holdout_after=fit.holdout_before)
    return names, groups, beside, kind, fit


def _only_one(alone, view, point: OnePoint, fit: Fit, tried: int) -> BestFit | None:
    """The only effect that explains a constant misfit, which one point does not confirm; None if several do or none.

    Its probability is that against columns of any direction, of which each leaves as little by chance.
    """
    if len(alone) != 1:
        return None
    near = min(k.FITS * resolution(view) / abs(point.constant), 1.0)  # sine of the angle between column and misfit
    by_chance = tried * 2.0 * float(np.arcsin(near)) / np.pi
    left = float(np.hypot(fit.noise_floor, abs(point.constant) * (1.0 - alone[0].explains) ** 0.5))
    return BestFit(alone, 1.0 / (1.0 + by_chance), left, "one operating point cannot confirm it")


def _is_unclear(names, left_over, drift: Fit) -> bool:
    """Whether nothing of a drift is named: where much of it is left, the rest may imitate what was found."""
    return bool(names) and left_over and drift.explained_share < k.NAMED_SHARE


def _beside_constant(names, groups, unknown, fit: Fit):
    """(names, groups, names withheld): beside a large unknown constant a drift may be its imitation."""
    return ((), (), names) if unknown and fit.explained_share < k.HALF else (names, groups, ())


def _sorted_out(best, tied, effects, view):
    """(names, ambiguity sets): what all tied sets share is named."""
    large = lambda s: {n for n in s.model.names if moved(effects[n], s.c[n], view) >= effects[n].floor(view.nominal)}  # noqa: E731
    sets = [large(s) for s in (best, *tied) if len(s.model) <= max(len(best.model), 1)]
    common, seen = set.intersection(*sets), set.union(*sets)
    rest = tuple(sorted(seen - common))
    return tuple(sorted(common)), (rest,) if len(rest) > 1 else ()


def _fit(cells, before, after, sigma, held) -> Fit:
    rows = (cells.channel == "u") & (cells.order == 0) & cells.ok
    out = held[cells.block]
    rms = lambda x, w: float(np.sqrt(2.0 * np.mean(x[rows & w] ** 2)))  # noqa: E731
    parts = [rms(x, w) for w in (~out, out) for x in (before, after)]
    return Fit("u_dq", "V", *parts, noise_floor=float(np.sqrt(2.0 * np.mean(sigma[rows] ** 2))))


def _spread(around, sigma) -> Fit:
    """The fit of a point that was not held long enough for a drift: its rows (b,) around a constant, nothing fitted."""
    size = float(np.sqrt(np.nanmean(np.abs(around) ** 2)))
    return Fit("u_dq", "V", size, size, size, size, float(np.sqrt(2.0 * np.mean(sigma**2))))


def _with_constant(fit: Fit, size, known) -> Fit:
    """The fit with the misfit [V] that stays the same over time; known: whether one of several effects explains it."""
    names = ("train_before", "holdout_before", *(() if known else ("train_after", "holdout_after")))
    return replace(fit, **{name: float(np.hypot(getattr(fit, name), size)) for name in names})


def _remainder(fit: Fit) -> tuple[Remainder, ...]:
    size = max(fit.holdout_after**2 - fit.noise_floor**2, 0.0) ** 0.5
    return (Remainder("u_dq", 0.0, size, "V", 1.0 - fit.explained_share),)


def _named(name, effect, best, wider, fitter, view) -> NamedEffect:
    """The effect with its estimates; their sigma covers the change by a further drift."""
    spread = max(1.0, best.chi2 / max(best.rows - best.count, 1))
    rest = fitter.chi2(best.model.without(name))[0]
    estimates = effect.estimates(best.c[name], best.covariance[name] * spread, view.nominal)
    for other in wider:
        changed = effect.estimates(other.c[name], other.covariance[name] * spread, view.nominal)
        estimates = {key: _widened(e, changed[key]) for key, e in estimates.items()}
    weight = max((rest - best.chi2) / spread, 0.0)
    share = (fitter.power - best.chi2) / max(fitter.power - best.rows, 1e-9)
    return NamedEffect(
        name,
        float(np.clip(1.0 - 1.0 / (1.0 + weight / 4.0), 0.5, 0.999)),
        estimates,
        float(np.clip(share, 0.0, 1.0)),
        effect.plant(best.c[name], view.nominal),
    )


def _widened(e: Estimate, other: Estimate) -> Estimate:
    return replace(e, sigma=float(max(e.sigma, np.hypot(other.sigma, other.value - e.value))))
