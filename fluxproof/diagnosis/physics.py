# SPDX-License-Identifier: BSD-3-Clause
"""The physical part of a diagnosis: from loaded recordings to a decision and the next recording."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fluxproof.diagnosis.balance.blocks import views_of
from fluxproof.diagnosis.balance.cells import voltage_rms
from fluxproof.diagnosis.balance.holdout import held_out, holdout_blocks
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.parts import sound
from fluxproof.diagnosis.balance.slow_view import SlowView, slow_view
from fluxproof.diagnosis.balance.used import little_used
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.conventions.restated import as_read
from fluxproof.diagnosis.decide.conclude import conclude
from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.decide.interpretation import restated, under
from fluxproof.diagnosis.decide.one_point import conclude_one_point
from fluxproof.diagnosis.decide.rules import not_compared
from fluxproof.diagnosis.decide.verdict import WHOLE
from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.diagnosis.ground.recording import Problem, Recording
from fluxproof.diagnosis.inference.linearise import Rows
from fluxproof.diagnosis.inference.posterior import Posterior
from fluxproof.diagnosis.inference.search import search
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.interpret.judge import preferred
from fluxproof.diagnosis.plan.next_recording import next_recording
from fluxproof.diagnosis.plan.planned import Planned
from fluxproof.diagnosis.suspects import SUSPECTS


@dataclass(frozen=True, eq=False)
class Outcome:
    """The decision on recordings of one drive, the points to record next, rows and findings of the recordings used."""

    decision: Decision
    planned: tuple[Planned, ...]
    rows: int
    problems: tuple[Problem, ...]


def explain(loaded: list[Recording], nominal: Nominal, progress=lambda text: None, shifts=None) -> Outcome:
    """Explain one recording, or several of the same drive, against a nominal drive.

    shifts: {effect: change of its log prior odds}.
    Raises RecordingError if the recordings contain no operating point for which a voltage balance can be made.
    """
    nominal, changed = as_read(loaded, nominal), loaded[0].meta.get("restated")
    used = sound(loaded, nominal, CATALOGUE)
    if any(r.fatal for r in used):
        return outcome(not_compared("bad_recording"), used)
    decision = restated(_decision(used, nominal, progress, shifts), changed)
    return outcome(decision, used, next_recording(decision, progress), little_used(used))


def outcome(decision: Decision, used: list[Recording], planned=(), more: tuple[Problem, ...] = ()) -> Outcome:
    """A decision on the recordings that were used; more: findings beside those of the checks."""
    problems = (*(p for r in used for p in r.problems), *more)
    return Outcome(decision, planned, sum(len(r) for r in used), problems)


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
    """Whether a view has one operating point, of which only the drift is evidence (decide/one_point.py)."""
    return isinstance(view, SlowView) and np.ptp(view.run) == 0


def rows_of(view, held) -> Rows:
    """The rows of a view, of which the blocks ``held`` (b,) bool are not fitted."""
    return Rows(view, view.visible(known_effects()), ~held)


def _posterior(view, held, progress, shifts) -> Posterior:
    progress("sets of effects")
    setup = Setup.of(rows_of(view, held))
    setup.shifts = dict(shifts or {})
    return search(setup, progress)


def _decision(recordings, nominal, progress, shifts) -> Decision:
    view, held = view_and_held(recordings, nominal)
    if single_point(view):
        return conclude_one_point(view)
    posterior = _posterior(view, held, progress, shifts)
    decision = conclude(posterior, held)
    if decision.verdict == "no_mismatch":
        return decision
    whole = decision.verdict in WHOLE  # a part is no reason against a reading that explains all
    readings, rivals, read = preferred(recordings, posterior, whole, progress)
    if not readings:
        return replace(decision, hinted=tuple(rivals))
    return under(readings, rivals, decision, conclude(read, held), voltage_rms(view))
