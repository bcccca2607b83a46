"""The physical part of a diagnosis: from loaded recordings to effects, ambiguities and the unexplained residual."""

from __future__ import annotations

from fluxproof.diagnosis.answer.conclude import conclude
from fluxproof.diagnosis.answer.headline import sentence
from fluxproof.diagnosis.balance.blocks import views_of
from fluxproof.diagnosis.balance.holdout import held_out
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.parts import sound
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.conventions.judge import preferred
from fluxproof.diagnosis.conventions.tell import under
from fluxproof.diagnosis.inference.linearise import Rows
from fluxproof.diagnosis.inference.posterior import Posterior
from fluxproof.diagnosis.inference.problem import Setup
from fluxproof.diagnosis.ingest.restated import as_read
from fluxproof.diagnosis.nominal import Nominal
from fluxproof.diagnosis.recording import Recording
from fluxproof.diagnosis.result import Diagnosis
from fluxproof.diagnosis.slow_diagnosis import diagnose_slow
from fluxproof.diagnosis.suspects import SUSPECTS


def explain(loaded: list[Recording], nominal: Nominal, progress=lambda text: None, shifts=None) -> Diagnosis:
    """Explain one recording, or several of the same drive, against a nominal drive.

    shifts: {effect: change of its log prior odds}, which slow logs, whose search has no prior, do not use.
    Raises RecordingError if the recordings contain no operating point for which a voltage balance can be made.
    """
    nominal = as_read(loaded, nominal)
    loaded = sound(loaded, nominal)
    problems = [p for r in loaded for p in r.problems]
    rows = sum(len(r) for r in loaded)
    if any(r.fatal for r in loaded):
        worst = next(p for p in problems if p.fatal)
        why = f"The recording cannot be used: {worst.located()}"
        return Diagnosis("bad_recording", why, rows=rows, problems=problems)
    if any(r.slow for r in loaded):  # sampled too slowly for a voltage balance between rows
        answer = diagnose_slow(loaded, nominal, progress)
    else:
        answer = _physics(loaded, nominal, progress, shifts)
    answer.rows, answer.problems = rows, problems
    if answer.verdict == "no_mismatch":  # it agrees as the checks read it, which the headline must say
        answer.sentence = sentence(answer, known_effects())
    return answer


def known_effects() -> dict:
    """{name: Effect} of the catalogue and of the causes beyond it."""
    return {**CATALOGUE, **SUSPECTS}


def rows_of(recordings, nominal):
    """(Rows, (b,) held-out blocks) of fast recordings of one drive."""
    views = views_of(recordings, nominal)
    view = joined_views(views)
    held = held_out(views)
    return Rows(view, view.visible(known_effects()), ~held), held


def posterior_of(recordings, nominal, progress=lambda text: None, shifts=None):
    """(posterior, (b,) held-out blocks) of fast recordings of one drive; shifts: see ``explain``."""
    rows, held = rows_of(recordings, nominal)
    progress("sets of effects")
    setup = Setup.of(rows)
    setup.shifts = dict(shifts or {})
    return Posterior(setup, progress), held


def _physics(recordings, nominal, progress, shifts) -> Diagnosis:
    posterior, held = posterior_of(recordings, nominal, progress, shifts)
    answer = conclude(posterior, held, progress)
    if answer.verdict == "no_mismatch":
        return answer
    readings, rivals, read = preferred(recordings, posterior, answer.verdict != "unexplained", progress)
    return under(readings, rivals, answer, conclude(read, held, progress)) if readings else answer
