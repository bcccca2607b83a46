# SPDX-License-Identifier: BSD-3-Clause
"""Several recordings of one drive: a part that cannot be used costs only that part.

    loaded = sound(loaded, nominal, CATALOGUE)  # of the rest, a finding names the parts that were left out and why

Parts are left out if a check found them unusable, or if they contain no steady operating point.
"""

from __future__ import annotations

from pathlib import Path

from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.slow_view import slow_view
from fluxproof.diagnosis.ground.recording import Problem, Recording, RecordingError


def sound(loaded: list[Recording], nominal, catalogue: dict) -> list[Recording]:
    """The recordings that can be used, if any can; otherwise all of them, so that the reason is reported."""
    if len(loaded) < 2:
        return loaded
    reasons = {id(recording): _reason(recording, nominal, catalogue) for recording in loaded}
    kept = [recording for recording in loaded if not reasons[id(recording)]]
    if not kept:
        return loaded
    for recording in loaded:
        if reasons[id(recording)]:
            left_out(kept[0], recording.source, reasons[id(recording)], len(recording))
    if len({recording.slow for recording in kept}) > 1:
        fast = ", ".join(Path(r.source).name for r in kept if not r.slow)
        kept[0].meta.setdefault("notes", []).append(
            f"recordings with and without a row per control period are diagnosed together by their operating points; "
            f"for harmonics and sampling instants, diagnose {fast} alone"
        )
    return kept


def left_out(recording: Recording, source, reason: str, rows: int = 0) -> None:
    """Record as a finding of ``recording`` that another part was not used."""
    finding = Problem("part_left_out", reason, "", 0 if rows else -1, rows, f"{Path(source).name} is not used")
    if finding not in recording.problems:
        recording.problems.append(finding)


def _reason(recording, nominal, catalogue) -> str:
    """Why a recording cannot be used; "" if it can."""
    for problem in recording.problems:
        if problem.fatal:
            return f"{recording.source}: {problem.located()}"
    try:
        (slow_view if recording.slow else view_of)(recording, nominal, catalogue)
    except RecordingError as error:
        return str(error)
    return ""
