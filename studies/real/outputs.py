# SPDX-License-Identifier: BSD-3-Clause
"""Outputs of a real recording: its folder and its entry of result.json."""

from __future__ import annotations

import time
from pathlib import Path

from fluxproof.diagnosis.build import worded
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.improve.improve import write_improved
from fluxproof.diagnosis.overlay.compare import closed_loop
from fluxproof.diagnosis.report.write import json_ready, write_outputs
from golden_model.drive_keys import DriveError

NAMES_OF_AXES = {
    "saturation": "saturation of an axis by its own current",
    "cross_saturation": "the current of one axis saturates the other",
}


def write(name: str, answer, nominal, recording, out: Path, more: dict, model=None) -> dict:
    """Write OUT/name/{diagnosis.json, report.html, drive_improved.toml} and return the entry of result.json.

    model: effects of the improved drive, if they are more than the asserted ones; more: further keys of the entry.
    """
    started, folder = time.perf_counter(), out / name
    folder.mkdir(parents=True, exist_ok=True)
    improved = write_improved(nominal, answer.effects if model is None else model, folder / "drive_improved.toml")
    overlay, why = None, None
    try:
        overlay = closed_loop(recording, nominal, improved)
    except (RecordingError, DriveError, ValueError) as error:
        why = str(error).replace(recording.source, Path(recording.source).name)
    if not answer.advice:
        answer = worded(answer, nominal)
    write_outputs(answer, folder, nominal, overlay)
    entry = {
        "verdict": answer.verdict,
        "sentence": answer.sentence,
        "effects": {e.name: _parameters(e) for e in answer.effects},
        "improved_model": {e.name: _parameters(e) for e in (answer.effects if model is None else model)},
        "ambiguity": answer.ambiguity,
        "next_recording": [vars(request) for request in answer.next_recording],
        "fit": vars(answer.fit),
        "notes": answer.notes,
        "closed_loop_rms": None if overlay is None else {k: overlay[k] for k in ("rms_before", "rms_after")},
        "closed_loop_left_out": why,
        "seconds": {"write": time.perf_counter() - started},
    }
    return json_ready(entry | more)


def _parameters(effect) -> dict:
    return {k: {"value": e.value, "sigma": e.sigma, "unit": e.unit} for k, e in effect.parameters.items()}
