"""The physical part of a diagnosis: from loaded recordings to effects, ambiguities and the unexplained residual."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis import verdict as words
from fluxproof.diagnosis.blocks import views_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.flux_surface import USUAL, earned
from fluxproof.diagnosis.locate import at_order, evidence, locate
from fluxproof.diagnosis.nominal import Nominal
from fluxproof.diagnosis.ohms import straight_ohms
from fluxproof.diagnosis.parts import sound
from fluxproof.diagnosis.recording import Recording
from fluxproof.diagnosis.remains import remains
from fluxproof.diagnosis.request import requests, wants_cold
from fluxproof.diagnosis.result import Diagnosis, UnknownTerm
from fluxproof.diagnosis.search import EARNS, Search
from fluxproof.diagnosis.slow_diagnosis import diagnose_slow
from fluxproof.diagnosis.uncertainty import Spread
from fluxproof.diagnosis.unknown import sparse_term
from fluxproof.diagnosis.view import joined_views, started_cold

HOLDOUT_EVERY = 4  # every fourth dwell is held out
MAP_POINTS = 20  # least number of distinct currents for fitting a flux map
ABSORBED = {"udc_gain", "current_scale", "inductance_d", "inductance_q"}


def explain(loaded: list[Recording], nominal: Nominal, progress=lambda text: None) -> Diagnosis:
    """Explain one recording, or several of the same drive, against a nominal drive.

    Raises RecordingError if the recordings contain no operating point for which a voltage balance can be made.
    """
    loaded = sound(loaded, nominal)
    problems = [p for r in loaded for p in r.problems]
    rows = sum(len(r) for r in loaded)
    if any(r.fatal for r in loaded):
        worst = next(p for p in problems if p.fatal)
        return Diagnosis(
            "bad_recording", f"The recording cannot be used: {worst.message}", rows=rows, problems=problems
        )
    if any(r.slow for r in loaded):  # sampled too slowly for a voltage balance between rows
        answer = diagnose_slow(loaded, nominal, progress)
    else:
        answer = _physics(loaded, nominal, progress)
    answer.rows, answer.problems = rows, problems
    return answer


def holdout_blocks(view) -> np.ndarray:
    """(b,) bool: blocks held out of the fit: every fourth dwell, or every fourth block if there are few dwells."""
    dwells = np.unique(view.run)
    if len(dwells) >= 8:
        return np.isin(view.run, dwells[2::HOLDOUT_EVERY])
    return np.arange(len(view)) % HOLDOUT_EVERY == 2


def held_out(views) -> np.ndarray:
    """(b,) bool: blocks held out of the fit, a part of each recording and never the whole of one."""
    return np.concatenate([holdout_blocks(v) for v in views])


def _physics(recordings, nominal, progress) -> Diagnosis:
    views = views_of(recordings, nominal)
    view = joined_views(views)
    held = held_out(views)
    search = Search(view, view.visible(CATALOGUE), ~held, progress)
    found = search.run()
    left = remains(search, found, held)
    both = {"dead_time", "resistance"} <= found.best.model.names
    straight = straight_ohms(search, found.best) if both else None
    names, ambiguity = words.groups(
        found.best, found.tied, CATALOGUE, nominal, found.silent, started_cold(view), straight
    )
    names = words.carried(names, found, left.cells, search.worth, CATALOGUE)
    names, absorbed = beside_free_surface(view, names, ~held)
    ambiguity = ambiguity + absorbed
    spread = Spread(search, found.best, left.reduced) if names else None
    names = words.beyond_doubt(spread, names) if names else names
    lag = words.lag_of_currents(found.best)
    kind = words.verdict(names, ambiguity, left, lag)
    answer = Diagnosis(kind, "", location=locate(view, search.cells, found.pure), fit=left.fit, search=found)
    if kind in ("explained", "ambiguous"):
        if names:
            answer.effects = words.named(spread, names, found.empty)
        answer.ambiguity = ambiguity
    if kind == "ambiguous":
        progress("choosing the next recording")
        noise_v = float(np.nanmedian(np.abs(at_order(search.cells, found.pure, 0.0))))
        rivals = [found.best, *found.tied]
        rivals += search.straightened(rivals)
        for group in [] if found.tied else ambiguity:  # the models without one of the alternatives
            rivals += [search.refine(found.best.model.without(n)) for n in group if n in found.best.model.names]
        open_names = sorted({n for group in ambiguity for n in group})
        answer.next_recording = requests(search, rivals, noise_v, wants_cold(open_names, view))
    if kind == "unexplained":
        answer.unknown_term = _lag(found, lag) if lag else _unknown(found, left)
    answer.evidence = evidence(
        view, (search.cells, search.cells.y), (left.cells, left.residual), found.pure, held
    )
    answer.sentence = words.sentence(kind, answer.effects, ambiguity, left.fit, CATALOGUE, answer.location)
    rows = view.u_dc.shape[1]
    answer.notes.append(
        f"The voltage balance was made on {len(view)} steady blocks of {rows} rows; {int(held.sum())} were not fitted."
    )
    share = left.fit.share_left
    answer.trace = (
        f"reduced chi2 {left.reduced:.2f}, share {share:.3f}, group {left.group!r}, stray {left.stray}"
    )
    return answer


def beside_free_surface(view, names, train):
    """(remaining names, ambiguity sets): scales and inductances must improve the fit of a free flux map.

    If the operating points cover the dq current plane, a free flux map can be fitted.  A scale or inductance error
    that no longer improves the fit had only absorbed the residual of a rigid saturation curve.
    """
    curved = sorted({"saturation", "cross_saturation"} & set(names))
    suspects = sorted(ABSORBED & set(names))
    i = view.i.mean(axis=1) / view.machine.rated_current_a
    points = len(np.unique(np.round(np.stack([i.real, i.imag], axis=1) / 0.12), axis=0))
    if not curved or not suspects or points < MAP_POINTS:
        return names, []
    others = tuple(n for n in names if n not in suspects and n not in curved and n not in USUAL)
    gains = earned(view, suspects, (*USUAL, *others), train)
    weak = [n for n in suspects if gains[n] < EARNS]
    return [n for n in names if n not in weak], [[n, *curved] for n in weak]


def _lag(found, lag) -> UnknownTerm:
    """The term for currents that are measured late, as a filter in front of the converters causes."""
    best, empty = found.best, found.empty
    spread = float(np.sqrt(best.covariance["delay"][0, 0]))
    share = (empty.chi2 - best.chi2) / max(empty.chi2 - empty.rows, 1e-9)
    return UnknownTerm("i_abc", "-lag di/dt", lag, spread, "s", float(np.clip(share, 0.0, 1.0)))


def _unknown(found, left) -> UnknownTerm | None:
    """The formula that fits the residual best."""
    stray = left.stray
    if stray is None:
        return sparse_term(found.best.view, left.cells, left.residual, found.sigma, found.train)
    signal = "torque" if stray.kind == "torque" else "u_dq"
    return UnknownTerm(signal, stray.formula, stray.value, stray.sigma, stray.unit, min(stray.explains, 1.0))
