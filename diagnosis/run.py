"""Why does a recording differ from its simulation: the whole way from files to a Diagnosis.

    from diagnosis import diagnose
    answer = diagnose("recording.csv", "drive.toml")
    print(answer.sentence)
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from diagnosis import verdict as words
from diagnosis.balance import misfit
from diagnosis.catalogue import CATALOGUE
from diagnosis.cells import voltage_level
from diagnosis.load import load_recording
from diagnosis.locate import at_order, evidence, locate
from diagnosis.nominal import Nominal, load_nominal
from diagnosis.recording import Recording
from diagnosis.request import requests
from diagnosis.result import Diagnosis, Fit, UnknownTerm
from diagnosis.scan import row_residual, stray_order, stray_swing, stray_torque
from diagnosis.search import Search
from diagnosis.unknown import sparse_term
from diagnosis.view import joined_views, view_of

GROUP_ROWS, GROUP_CHI2, GROUP_SHARE = 12, 3.0, 0.4
HOLDOUT_EVERY = 4  # each fourth dwell is never fitted


def diagnose(recordings, drive, progress=lambda text: None) -> Diagnosis:
    """Diagnose one recording, or several of the same drive, against a nominal drive.

    recordings: a path, a Recording, or a list of them; drive: a path to drive.toml or a Nominal.
    Raises RecordingError and golden_model's DriveError for input that cannot be used.
    """
    nominal = drive if isinstance(drive, Nominal) else load_nominal(drive)
    if isinstance(recordings, (str, os.PathLike, Recording)):
        recordings = [recordings]
    loaded = []
    for item in recordings:
        progress(f"reading {item if not isinstance(item, Recording) else item.source}")
        loaded.append(item if isinstance(item, Recording) else load_recording(Path(item), nominal))
    problems = [p for r in loaded for p in r.problems]
    rows = sum(len(r) for r in loaded)
    if any(r.fatal for r in loaded):
        worst = next(p for p in problems if p.fatal)
        return Diagnosis("bad_recording", f"The recording cannot be used: {worst.message}", rows=rows, problems=problems)
    answer = _physics(loaded, nominal, progress)
    answer.rows, answer.problems = rows, problems
    return answer


def holdout_blocks(view) -> np.ndarray:
    """(b,) blocks whose operating points are not fitted: every fourth dwell, or blocks where there are few dwells."""
    dwells = np.unique(view.run)
    if len(dwells) >= 8:
        return np.isin(view.run, dwells[2::HOLDOUT_EVERY])
    return np.arange(len(view)) % HOLDOUT_EVERY == 2


def _physics(recordings, nominal, progress) -> Diagnosis:
    view = joined_views([view_of(r, nominal) for r in recordings])
    held = holdout_blocks(view)
    search = Search(view, CATALOGUE, ~held, progress)
    found = search.run()
    best, empty = found.best, found.empty
    fit = fits(search, found, held)
    location = locate(view, search.cells, found.pure)
    left, group = leftover(search, found)
    names, ambiguity = words.groups(best, found.tied, CATALOGUE, nominal)
    names = words.carried(names, best, lambda n: search.refine(best.model.without(n)).chi2 - best.chi2)
    share = fit.share_left
    rows = row_residual(best.view, best, CATALOGUE, misfit(best.view))
    level = voltage_level(view)
    stray = (
        stray_order(best.view, rows, level)
        or stray_swing(best.view, rows, level)
        or stray_torque(best.view, search.projector, *final_residual(search, found), found.sigma)
    )
    if not names and not ambiguity:
        verdict = "no_mismatch" if left <= words.LEFTOVER else "unexplained"
    elif left > words.LEFTOVER and share > words.FLOOR_SHARE:
        verdict = "unexplained"
    else:
        verdict = "ambiguous" if ambiguity else "explained"
    if stray or group:
        verdict = "unexplained"
    trace = f"reduced chi2 {left:.2f}, share {share:.3f}, group {group!r}, stray {stray}"
    answer = Diagnosis(verdict, "", location=location, fit=fit)
    if verdict in ("explained", "ambiguous"):
        answer.effects = words.named(best, names, CATALOGUE, nominal, empty, found.dispersion)
        answer.ambiguity = ambiguity
    if verdict == "ambiguous":
        progress("the recording that would tell")
        noise_v = float(np.nanmedian(np.abs(at_order(search.cells, found.pure, 0.0))))
        answer.next_recording = requests(view, [best, *found.tied], CATALOGUE, noise_v)
    if verdict == "unexplained":
        cells, residual = final_residual(search, found)
        answer.unknown_term = sparse_term(best.view, cells, residual, found.sigma, found.train)
        if stray:
            signal, unit = ("torque", "Nm") if stray.kind == "torque" else ("u_dq", "V")
            answer.unknown_term = UnknownTerm(signal, stray.formula, stray.amplitude, 0.05 * stray.amplitude, unit, 0.5)
    answer.trace = trace
    cells, residual = final_residual(search, found)
    answer.evidence = evidence(view, (search.cells, search.cells.y), (cells, residual), found.pure, held)
    answer.sentence = words.sentence(verdict, answer.effects, ambiguity, fit, CATALOGUE, location)
    answer.notes.append(f"{len(view)} steady blocks of {view.u_dc.shape[1]} rows were balanced, {int(held.sum())} of them never fitted.")
    answer.search = found
    return answer


def final_residual(search, found):
    """(cells, residual) of the best model on its corrected data, every order."""
    best = found.best
    fitter = search.fitter(best.view, [CATALOGUE[n] for n in sorted(best.model.names)])
    return fitter.cells, fitter.solve(best.model).residual


def leftover(search, found) -> tuple[float, str]:
    """Reduced chi^2 that the best model leaves on the rows it was fitted to, and the group that stands out, or ''.

    A group is a channel's order.  It stands out when much is left of it that is neither noise nor a curve's
    imperfection: an explanation leaves no group as it was.
    """
    cells, residual = final_residual(search, found)
    use = cells.ok & found.train
    chi = (residual / found.sigma) ** 2
    worst, floor = (0.0, ""), least(search.view)
    for channel in np.unique(cells.channel):
        for order in np.unique(cells.order[cells.channel == channel]):
            rows = use & (cells.channel == channel) & (cells.order == order)
            if rows.sum() < GROUP_ROWS:
                continue
            after = np.mean(residual[rows] ** 2) - np.mean(found.pure[rows] ** 2)
            before = np.mean(search.cells.y[rows] ** 2)
            if chi[rows].mean() > GROUP_CHI2 and after > max(GROUP_SHARE**2 * before, floor[channel] ** 2):
                share = np.sqrt(after / before)
                worst = max(worst, (float(share), f"{channel} at order {order:g}"))
    return float(np.sum(chi[use])) / max(use.sum() - found.best.count, 1), worst[1]


def least(view) -> dict[str, float]:
    """What is too little to be spoken of, per channel."""
    m = view.machine
    torque = 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a
    return {
        "u": 1e-3 * float(voltage_level(view).max()),
        "sum": 2e-3 * m.rated_current_a,
        "torque": 8e-3 * torque,
    }


def fits(search, found, held) -> Fit:
    """Misfit before and after, rms over blocks of all its orders, on fitted and held-out blocks [V]."""
    cells, residual = final_residual(search, found)

    def rms(values, blocks):
        use = cells.ok & (cells.channel == "u") & blocks[cells.block]
        power = np.bincount(cells.block[use], values[use] ** 2, minlength=len(blocks))[blocks]
        return float(np.sqrt(power.mean())) if len(power) else 0.0

    return Fit(
        "u_dq",
        "V",
        rms(search.cells.y, ~held),
        rms(residual, ~held),
        rms(search.cells.y, held),
        rms(residual, held),
        rms(found.pure, ~held),
    )
