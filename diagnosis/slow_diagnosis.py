"""The diagnosis of slow logs: operating points, all sets of effects, and the limits of such a log.

    answer = diagnose_slow([recording], nominal)

physics.explain calls it if every recording is slow; the result is of the same type.  ``answer.search`` is the
search, ``answer.found`` its outcome, ``answer.held`` the blocks that were held out.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.answer.headline import sentence
from fluxproof.diagnosis.answer.locate import evidence, locate
from fluxproof.diagnosis.answer.request import requests
from fluxproof.diagnosis.answer.slow_names import bearable, kind_of, sorted_out
from fluxproof.diagnosis.answer.uncertainty import named
from fluxproof.diagnosis.balance.cells import voltage_level
from fluxproof.diagnosis.balance.holdout import FEW, holdout_blocks
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.slow_view import slow_view
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.conventions.judge import preferred
from fluxproof.diagnosis.conventions.tell import not_told, under
from fluxproof.diagnosis.inference import constants as k
from fluxproof.diagnosis.inference.posterior import Posterior
from fluxproof.diagnosis.inference.problem import Setup
from fluxproof.diagnosis.inference.settle import fit_of_set
from fluxproof.diagnosis.inference.slow_search import SlowSearch, most_effects
from fluxproof.diagnosis.one_point import diagnose_one_point
from fluxproof.diagnosis.result import Diagnosis, Fit, Remainder


def diagnose_slow(recordings, nominal, progress=lambda text: None) -> Diagnosis:
    """Diagnose slow recordings of one drive.

    Raises RecordingError if they contain no steady operating point.
    """
    view = joined_views([slow_view(r, nominal) for r in recordings])
    answer = diagnose_points(view, progress)
    if answer.verdict == "no_mismatch" or len(np.unique(view.run)) == 1:
        return answer
    posterior = Posterior(Setup(view, view.visible(CATALOGUE), ~holdout_blocks(view)), progress)
    readings, rivals, _ = preferred(recordings, posterior, answer.verdict != "unexplained", progress)
    if not readings:
        return answer
    for reading in readings:
        view = reading.of_view(view)
    read = diagnose_points(view, progress)
    if not bearable(read.fit, _level(view)):
        return not_told(readings, answer)
    return under(readings, rivals, answer, read, k.NAMED_SHARE)


def diagnose_points(view, progress=lambda text: None) -> Diagnosis:
    """Diagnose the operating points of a SlowView."""
    if len(np.unique(view.run)) == 1:
        return diagnose_one_point(view)
    held = holdout_blocks(view)
    search = SlowSearch(view, ~held, progress)
    found = search.run()
    names, ambiguity, weak = sorted_out(found)
    fit = _fit(search, found, found.best, held)
    verdict = kind_of(fit, found, names, ambiguity, _level(view))
    told = found.best if verdict in ("explained", "partly_explained", "ambiguous") else found.empty
    if told is found.empty:  # nothing is named, so nothing is explained and the whole misfit is left
        fit = _fit(search, found, told, held)
    answer = Diagnosis(verdict, "", location=locate(view, search.cells, found.pure), fit=fit)
    if told is found.best:
        answer.effects = model_effects(search, found, names)
        answer.ambiguity = ambiguity
    if verdict != "no_mismatch":
        answer.explained_share = fit.explained_share
    if verdict in ("partly_explained", "unexplained"):
        size = max(fit.holdout_after**2 - fit.noise_floor**2, 0.0) ** 0.5
        answer.remainder = [Remainder("u_dq", 0.0, size, "V", 1.0 - fit.explained_share)]
    if answer.ambiguity:
        progress("choosing the next recording")
        setup = Setup(view, search.effects, ~held)
        fits = [fit_of_set(setup, s.model.names) for s in (found.best, *found.tied)]
        answer.next_recording = requests(setup, fits, fit.noise_floor)
    cells, residual = search.residual(told)
    answer.evidence = evidence(view, (search.cells, search.cells.y), (cells, residual), found.pure, held)
    answer.sentence = sentence(answer, CATALOGUE)
    answer.notes = _notes(view, held, answer.ambiguity) + _doubts(found, verdict, weak)
    answer.search, answer.found, answer.held = search, found, held
    return answer


def model_effects(search, found, names=None):
    """NamedEffects of the best model: those in ``names``, or all of them (tied or not) for a simulation."""
    names = sorted(found.best.model.names) if names is None else names
    return named(found.best, CATALOGUE, search.view.nominal, names, found.empty, found.dispersion)


def axis_misfit(search, solution, blocks) -> dict:
    """{"d", "q": {"before", "after"}}: rms of the blocks' mean misfit (b,) bool with and without a solution [V]."""
    cells, residual = search.residual(solution)
    out = {}
    for part, axis in enumerate("dq"):
        rows = (cells.channel == "u") & (cells.order == 0) & (cells.part == part) & blocks[cells.block]
        both = {"before": search.cells.y[rows], "after": residual[rows]}
        out[axis] = {k: float(np.sqrt(np.mean(x**2))) if len(x) else float("nan") for k, x in both.items()}
    return out


def _level(view) -> float:
    """rms of the voltage [V]."""
    return float(np.sqrt(np.mean(voltage_level(view) ** 2)))


def _fit(search, found, solution, held) -> Fit:
    def both(blocks):
        d, q = axis_misfit(search, solution, blocks).values()
        return [float(np.hypot(d[k], q[k])) for k in ("before", "after")]

    floor = float(np.sqrt(2.0 * np.mean(found.sigma[(search.cells.order == 0) & (search.cells.channel == "u")] ** 2)))
    return Fit("u_dq", "V", *both(~held), *both(held), floor)


def _notes(view, held, ambiguity) -> list[str]:
    m = view.machine
    points = len(np.unique(view.run))
    unseen = [name for name, effect in CATALOGUE.items() if not view.shows(effect).any()]
    notes = [
        f"The voltage balance was made on {len(view)} steady stretches at {points} operating points; "
        f"{int(held.sum())} of the stretches were not fitted.",
        f"Operating points have no harmonics and no sampling instants; these effects cannot be diagnosed: "
        f"{', '.join(unseen)}.",
    ]
    if not view.d_known.all():
        notes.append("u_d is not recorded: only the q axis was balanced.")
    if points < FEW:
        notes.append(
            f"With {points} operating points at most {most_effects(points)} of the effects can be named at once, and "
            "every fourth stretch instead of every fourth point was held out: record more points."
        )
    i = view.i.mean(axis=1)
    if not i.real.any():
        notes.append("The d axis never had a current: L_d and the saturation of the d axis cannot be diagnosed.")
    if len({x > 0 for x in np.sign(view.omega[:, 0]) if x}) < 2:
        notes.append(
            "One direction only: encoder offset and inverter loss are separated from others by load and speed alone."
        )
    share = float((m.resistance_ohm * np.abs(i) / voltage_level(view).clip(1e-9)).max())
    if share < 0.1:
        notes.append(f"The resistance drops at most {share:.1%} of the voltage: it cannot be determined here.")
    for group in ambiguity:
        for name in group:
            notes.append(f"{name} is separated from similar effects by: {CATALOGUE[name].separated_by}.")
    return notes


def _doubts(found, verdict, weak) -> list[str]:
    """Effects of the best model that are not named, with the reason."""
    if verdict == "no_mismatch":
        names, why = sorted(found.best.model.names), "the misfit is at the noise floor"
    elif verdict == "unexplained":
        names, why = sorted(found.best.model.names), "too much is left for it to be asserted"
    else:
        names, why = weak, "not significantly"
    return [f"{name} improves the fit, but {why}." for name in names]
