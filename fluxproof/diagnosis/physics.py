# SPDX-License-Identifier: BSD-3-Clause
"""The physical part of a diagnosis: from loaded recordings to effects, ambiguities and the unexplained residual."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.answer.conclude import conclude
from fluxproof.diagnosis.answer.headline import sentence
from fluxproof.diagnosis.balance.blocks import views_of
from fluxproof.diagnosis.balance.cells import voltage_rms
from fluxproof.diagnosis.balance.holdout import held_out, holdout_blocks
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.parts import sound
from fluxproof.diagnosis.balance.slow_view import SlowView, slow_view
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.diagnosis.ground.recording import Recording
from fluxproof.diagnosis.ground.result import Diagnosis
from fluxproof.diagnosis.inference.linearise import Rows
from fluxproof.diagnosis.inference.posterior import Posterior
from fluxproof.diagnosis.inference.search import search
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.interpret.judge import preferred
from fluxproof.diagnosis.interpret.tell import under
from fluxproof.diagnosis.loading.restated import as_read
from fluxproof.diagnosis.one_point import diagnose_one_point
from fluxproof.diagnosis.suspects import SUSPECTS


def explain(loaded: list[Recording], nominal: Nominal, progress=lambda text: None, shifts=None) -> Diagnosis:
    """Explain one recording, or several of the same drive, against a nominal drive.

    shifts: {effect: change of its log prior odds}.
    Raises RecordingError if the recordings contain no operating point for which a voltage balance can be made.
    """
    nominal = as_read(loaded, nominal)
    loaded = sound(loaded, nominal, CATALOGUE)
    problems = [p for r in loaded for p in r.problems]
    rows = sum(len(r) for r in loaded)
    if any(r.fatal for r in loaded):
        worst = next(p for p in problems if p.fatal)
        why = f"The recording cannot be used: {worst.located()}"
        return Diagnosis("bad_recording", why, rows=rows, problems=problems)
    answer = _physics(loaded, nominal, progress, shifts)
    answer.rows, answer.problems = rows, problems
    if answer.verdict == "no_mismatch":  # it agrees as the checks read it, which the headline must say
        answer.sentence = sentence(answer, known_effects())
    return answer


def known_effects() -> dict:
    """{name: Effect} of the catalogue and of the causes beyond it."""
    return {**CATALOGUE, **SUSPECTS}


def view_and_held(recordings, nominal):
    """(View, (b,) held-out blocks) of recordings of one drive: blocks of rows, or operating points.

    Operating points if any of them is sampled too slowly for a voltage balance between rows.
    """
    if any(r.slow for r in recordings):
        view = joined_views([slow_view(r, nominal, CATALOGUE) for r in recordings])
        # A file may be a single operating point, so that some are held out of all files together.
        return view, holdout_blocks(view)
    views = views_of(recordings, nominal, CATALOGUE)
    return joined_views(views), held_out(views)


def single_point(view) -> bool:
    """Whether a view has one operating point, of which only the drift is evidence (one_point.py)."""
    return isinstance(view, SlowView) and np.ptp(view.run) == 0


def rows_of(view, held) -> Rows:
    """The rows of a view, of which the blocks ``held`` (b,) bool are not fitted."""
    return Rows(view, view.visible(known_effects()), ~held)


def _posterior(view, held, progress, shifts) -> Posterior:
    progress("sets of effects")
    setup = Setup.of(rows_of(view, held))
    setup.shifts = dict(shifts or {})
    return search(setup, progress)


def _physics(recordings, nominal, progress, shifts) -> Diagnosis:
    view, held = view_and_held(recordings, nominal)
    if single_point(view):
        return diagnose_one_point(view)
    posterior = _posterior(view, held, progress, shifts)
    answer = conclude(posterior, held, progress)
    if answer.verdict == "no_mismatch":
        return answer
    readings, rivals, read = preferred(recordings, posterior, answer.verdict != "unexplained", progress)
    if not readings:
        return answer
    return under(readings, rivals, answer, conclude(read, held, progress), voltage_rms(view))
