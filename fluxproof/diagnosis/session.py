# SPDX-License-Identifier: BSD-3-Clause
"""A complete diagnosis: digital part, physics, improved drive, closed-loop comparison, output files.

    from fluxproof import diagnose
    answer = diagnose("recording.csv", "drive.toml")

``diagnose`` does steps 1 and 2 and writes nothing; ``run`` does what the command does:

1. If the recording contains the core's inputs and outputs, the core is replayed.  A difference in any bit is the
   verdict, and the physics is not diagnosed.
2. The physics (physics.py).
3. OUT/drive_improved.toml with the asserted values, and closed-loop simulations of both drives over the recording.
4. OUT/diagnosis.json and OUT/report.html.

All files enter OUT together at the end (fluxproof/stage.py).
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from fluxproof.diagnosis.answer.advice import complete
from fluxproof.diagnosis.answer.flux_found import NAME as FLUX_MAP
from fluxproof.diagnosis.answer.flux_found import write_flux_map
from fluxproof.diagnosis.answer.improve import write_improved
from fluxproof.diagnosis.balance.parts import left_out
from fluxproof.diagnosis.checks import check_recording
from fluxproof.diagnosis.conventions.apply import read_drive, read_recording
from fluxproof.diagnosis.fleet.prior import among, load_prior
from fluxproof.diagnosis.ground.nominal import Nominal, load_nominal
from fluxproof.diagnosis.ground.recording import Problem, Recording, RecordingError
from fluxproof.diagnosis.ground.result import FILES, Diagnosis, Digital
from fluxproof.diagnosis.inference.posterior import Posterior
from fluxproof.diagnosis.interpret.tell import restate
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.overlay.compare import closed_loop
from fluxproof.diagnosis.physics import explain, known_effects
from fluxproof.diagnosis.replay.digital import replay
from fluxproof.diagnosis.report import write_outputs
from fluxproof.files import refuse_overwriting
from fluxproof.stage import together
from golden_model.drive_keys import DriveError

IMPROVED, ANSWER = "drive_improved.toml", "diagnosis.json"
FLUX_MAP_NOTE = (
    "flux_map.csv contains the flux linkage over the recorded currents; "
    'use it by [plant.machine] flux_map = "flux_map.csv".'
)
OVERLAY_SIGNALS = ("u_d_ref", "u_q_ref")  # not the currents: the controller regulates them to their references


def diagnose(recordings, drive, progress=lambda text: None, prior=None) -> Diagnosis:
    """Diagnose one recording, or several of the same drive, against a nominal drive; writes nothing.

    recordings: a path, a Recording, or a list of them; drive: a path to drive.toml or a Nominal; progress: called with
    a line of text at each step; prior: path of a fleet.parquet of drives with the same drive file, or None.
    If the recordings contain the core's outputs, the core is replayed first.
    Raises RecordingError and DriveError for unusable input.
    """
    nominal = drive if isinstance(drive, Nominal) else load_nominal(drive)
    with threadpool_limits(1):  # many small matrices: more threads only wait
        return _diagnose(_loaded(recordings, nominal, progress), nominal, progress, prior)


def run(recordings, drive, out, progress=lambda text: None, prior=None) -> Diagnosis:
    """``diagnose`` and write the output files to the folder ``out``; raises OSError if it cannot be written."""
    nominal = drive if isinstance(drive, Nominal) else load_nominal(drive)
    with threadpool_limits(1):
        _keep_inputs(Path(out), nominal, [*_listed(recordings), prior])
        loaded = _loaded(recordings, nominal, progress)
        with together(out, FILES) as stage:
            answer = _diagnose(loaded, nominal, progress, prior)
            _write(answer, loaded[0], nominal, stage, Path(out), progress)
    return answer


def _write(answer, recording, nominal, stage, out, progress) -> None:
    """All files of the answer into ``stage``, from where they enter ``out``."""
    improved = _improved(nominal, answer, stage, recording)
    if write_flux_map(answer, stage):
        answer.notes.append(FLUX_MAP_NOTE)
    laid_over = None
    if answer.verdict not in ("bad_recording", "digital_mismatch"):
        progress("the closed loop over the recording")
        read = read_recording(recording, answer.readings), read_drive(nominal, answer.readings)
        laid_over = _overlay(*read, improved and (improved, out / IMPROVED), answer)
    progress("writing the report")
    write_outputs(answer, stage, nominal, laid_over)


def _listed(recordings) -> list:
    return [recordings] if isinstance(recordings, (str, os.PathLike, Recording)) else list(recordings)


def _loaded(recordings, nominal, progress) -> list[Recording]:
    loaded, refused = [], []
    for item in _listed(recordings):
        if not isinstance(item, Recording):
            progress(f"reading {item}")
            try:
                item = load_recording(Path(item), nominal)
            except RecordingError as error:
                if not Path(item).is_file():  # a wrong name is not a bad part
                    raise
                refused.append((item, error))
                continue
        elif not item.checked:
            item = _checked(item, nominal)
        loaded.append(item)
    if not loaded:
        raise refused[0][1]
    for source, error in refused:  # a part that cannot be read costs only that part
        left_out(loaded[0], source, str(error))
    return loaded


def _checked(recording: Recording, nominal: Nominal) -> Recording:
    """A copy of a recording that was made of arrays, after the checks that every file gets."""
    columns, meta = dict(recording.columns), dict(recording.meta)
    usable, joined = recording.usable.copy(), recording.joined.copy()
    copy = replace(recording, columns=columns, meta=meta, usable=usable, joined=joined, problems=[*recording.problems])
    check_recording(copy, nominal)
    return copy


def _diagnose(loaded, nominal, progress, fleet=None) -> Diagnosis:
    """The digital part, then the physics if the controller's outputs equal those of its golden model."""
    prior = load_prior(fleet, nominal.path) if fleet is not None else None
    digital, notes = _digital(loaded, progress)
    if digital.first_difference is not None:
        answer = Diagnosis("digital_mismatch", _mismatch_sentence(digital.first_difference))
        answer.rows = sum(len(recording) for recording in loaded)
        answer.problems = [p for recording in loaded for p in recording.problems]
    else:
        answer = _physics(loaded, nominal, progress, prior.shifts() if prior else None)
        restate(answer, loaded)
    answer.digital = digital
    if prior is not None:
        answer.prior = among(prior, answer)
        notes.append(_prior_note(answer))
    answer.notes = [*notes, *answer.notes, *_reading_notes(loaded)]
    complete(answer, read_drive(nominal, answer.readings), known_effects())
    return answer


def _keep_inputs(out: Path, nominal: Nominal, read: list) -> None:
    """Before the long computation: FileExistsError or DriveError if results would overwrite a file of the user.

    read: recordings, by path or as objects, and the fleet; None for none.
    """
    used = nominal.plant.get("machine", {}).get("flux_map")
    flux_map = Path(nominal.path or "").parent / used if isinstance(used, str) else None
    files = [item for item in read if not isinstance(item, Recording)]
    refuse_overwriting([out / name for name in FILES], [nominal.path, flux_map, *files])
    chart = out / FLUX_MAP
    if chart.exists() and not (out / ANSWER).exists():
        raise DriveError(f"{chart}: no diagnosis wrote this, and it would be overwritten; choose another folder")


def _prior_note(answer) -> str:
    """That a fleet was the prior, and what it did."""
    fleet = answer.prior
    used = isinstance(answer.search, Posterior)
    if used:
        did = "it changed the prior odds of the effects, to even odds at most, so the fleet alone is no evidence"
    elif answer.verdict in ("bad_recording", "digital_mismatch"):
        did = "it was not used, as the physics was not diagnosed"
    else:
        did = "it was not used, as one operating point is judged without a prior"
    return f"The population of {fleet.drives} drives in {fleet.path} was the prior: {did}."


def _physics(loaded, nominal, progress, shifts) -> Diagnosis:
    """The verdict of physics.py; a recording without a usable operating point is a bad recording."""
    try:
        return explain(loaded, nominal, progress, shifts)
    except RecordingError as error:
        problem = Problem("no_balance", str(error), fatal=True)
        problems = [p for recording in loaded for p in recording.problems]
        rows = sum(len(recording) for recording in loaded)
        sentence = f"The recording cannot be used: {error}"
        return Diagnosis("bad_recording", sentence, rows=rows, problems=[*problems, problem])


def _digital(loaded, progress) -> tuple[Digital, list[str]]:
    """Replay every recording that contains the core's outputs, up to the first difference."""
    digital, notes = Digital(), []
    for recording in loaded:
        if not {"telemetry", "registers"} & set(recording.meta):
            continue
        progress("replaying the core")
        found, said = replay(recording)
        name = f"{Path(recording.source).name}: " if len(loaded) > 1 else ""
        notes += [f"{name}{sentence}" for sentence in said]
        digital = Digital(digital.checked or found.checked, digital.samples + found.samples)
        if found.first_difference is not None:
            digital.first_difference = flat(found.first_difference)
            if len(loaded) > 1:
                digital.first_difference["recording"] = recording.source
            break
    if digital.checked and digital.first_difference is None:
        notes.append("The controller equals its golden model in every bit, so any difference is physical.")
    return digital, notes


def flat(difference: dict) -> dict:
    """A first difference as a flat mapping of numbers, texts and None for diagnosis.json: lists are joined."""
    out = {}
    for key, value in difference.items():
        if isinstance(value, dict):
            out[key] = value.get("says")
            inner = {k: v for k, v in flat(value).items() if k != "says"}
            out |= {f"{key}_{k}": v for k, v in inner.items()}
        elif isinstance(value, (list, tuple)):
            out[key] = ", ".join(map(str, value))
        else:
            out[key] = value
    return out


def _mismatch_sentence(d: dict) -> str:
    """Sentence with block, sample, signal and bit of the first difference, and its cause if one was found."""
    text = (
        f"The controller's output differs from its golden model: block {d['block']}, sample {d['sample']}, "
        f"signal {d['signal']}, bit {d['bit']} (recorded {d['recorded']}, golden model {d['golden']})"
    )
    return f"{text}; {d['cause']}." if d.get("cause") else f"{text}."


def _reading_notes(loaded) -> list[str]:
    """The notes of the readers without duplicates."""
    notes = [note for recording in loaded for note in recording.meta.get("notes", [])]
    return list(dict.fromkeys(notes))


def _improved(nominal, answer, stage, recording) -> Path | None:
    """Write the improved drive if anything was found."""
    if not answer.effects and not answer.readings:
        return None
    try:
        return write_improved(nominal, answer.effects, stage / IMPROVED, answer.readings, recording)
    except (DriveError, ValueError) as error:
        answer.notes.append(f"No {IMPROVED}: {error}.")
        return None


def _named(file: Path, name: Path) -> Nominal:
    """The drive of a file that will have another name: files that it refers to are beside that."""
    try:
        return replace(load_nominal(file), path=str(name))
    except DriveError as error:
        raise DriveError(str(error).replace(str(file), str(name))) from None


def _overlay(recording, nominal, improved, answer) -> dict | None:
    """The closed-loop simulation of the first recording; a drive that cannot be simulated only adds a note.

    improved: (the improved drive's file, its name when all is written), or None.
    """
    try:
        laid_over = closed_loop(recording, nominal, _named(*improved) if improved else None)
    except (ArithmeticError, IndexError, KeyError, TypeError, ValueError) as error:  # RecordingError, DriveError too
        answer.notes.append(f"The closed loop was not simulated: {error}.")
        return None
    for signal in OVERLAY_SIGNALS:
        before = laid_over["rms_before"].get(signal)
        after = laid_over.get("rms_after", {}).get(signal)
        if before is not None:
            then = f" and by {after:.3g} V with the improved drive" if after is not None else ""
            answer.notes.append(
                f"In closed-loop simulation, {signal} differs by {before:.3g} V rms with the nominal drive{then}."
            )
    return laid_over
