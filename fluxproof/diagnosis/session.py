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
from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from fluxproof.diagnosis.balance.parts import left_out
from fluxproof.diagnosis.build import Beside, build
from fluxproof.diagnosis.checks import check_recording
from fluxproof.diagnosis.conventions.apply import read_drive, read_recording
from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.decide.rules import not_compared
from fluxproof.diagnosis.effects import MeasurementError
from fluxproof.diagnosis.ground.nominal import Nominal, load_nominal
from fluxproof.diagnosis.ground.recording import Problem, Recording, RecordingError
from fluxproof.diagnosis.ground.result import FILES, Diagnosis, Digital
from fluxproof.diagnosis.improve.flux_found import NAME as FLUX_MAP
from fluxproof.diagnosis.improve.flux_found import write_flux_map
from fluxproof.diagnosis.improve.improve import to_write, write_improved
from fluxproof.diagnosis.improve.untrimmed import given_trims, without_trims
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.loading.together import together as together_read
from fluxproof.diagnosis.overlay.compare import closed_loop, is_worse
from fluxproof.diagnosis.physics import Outcome, explain, known_effects, outcome
from fluxproof.diagnosis.replay.digital import replay
from fluxproof.diagnosis.replay.trims import as_ran
from fluxproof.diagnosis.report import write_outputs
from fluxproof.diagnosis.words.further_notes import FLUX_MAP as FLUX_MAP_NOTE
from fluxproof.diagnosis.words.further_notes import (
    WORSE,
    loop_notes,
    not_improved,
    not_simulated,
    not_trimmed,
    prior_note,
    ran_with,
    trims_unknown,
)
from fluxproof.files import refuse_overwriting
from fluxproof.stage import together
from golden_model.drive_file import read_tables
from golden_model.drive_keys import DriveError

IMPROVED, ANSWER = "drive_improved.toml", "diagnosis.json"


@dataclass(frozen=True, eq=False)
class Worked:
    """A diagnosis before its sentences: what the physics and the session found, and the drive it was found against."""

    outcome: Outcome
    beside: Beside
    nominal: Nominal

    @property
    def decision(self) -> Decision:
        """What was decided, and what it was decided from."""
        return self.outcome.decision

    def answer(self, *after: str, improved=True, worse=False) -> Diagnosis:
        """The diagnosis; after: notes on the written files; improved, worse: as in Beside."""
        return build(self.outcome, self.nominal, replace(self.beside, after=after, improved=improved, worse=worse))


def diagnose(recordings, drive, progress=lambda text: None, prior=None) -> Diagnosis:
    """Diagnose one recording, or several of the same drive, against a nominal drive; writes nothing.

    recordings: a path, a Recording, or a list of them; drive: a path to drive.toml or a Nominal; progress: called with
    a line of text at each step; prior: path of a fleet.parquet of drives with the same drive file, or None.
    If the recordings contain the core's outputs, the core is replayed first.
    Raises RecordingError and DriveError for unusable input.
    """
    return work(recordings, drive, progress, prior).answer()


def work(recordings, drive, progress=lambda text: None, prior=None) -> Worked:
    """``diagnose`` with what the answer was decided from."""
    nominal = drive if isinstance(drive, Nominal) else load_nominal(drive)
    with threadpool_limits(1):  # many small matrices: more threads only wait
        return _worked(_loaded(recordings, nominal, progress), nominal, progress, prior)


def run(recordings, drive, out, progress=lambda text: None, prior=None) -> Diagnosis:
    """``diagnose`` and write the output files to the folder ``out``; raises OSError if it cannot be written."""
    nominal = drive if isinstance(drive, Nominal) else load_nominal(drive)
    with threadpool_limits(1):
        _keep_inputs(Path(out), nominal, [*_listed(recordings), prior])
        loaded = _loaded(recordings, nominal, progress)
        with together(out, FILES) as stage:
            worked = _worked(loaded, nominal, progress, prior)
            return _write(worked, loaded[0], stage, Path(out), progress)


def _write(worked: Worked, recording, stage, out, progress) -> Diagnosis:
    """All files of the answer into ``stage``, from where they enter ``out``."""
    nominal, decision, notes, laid_over = worked.nominal, worked.decision, [], None
    improved = _improved(nominal, decision, stage, recording, notes.append)
    worse = False
    if write_flux_map(decision, stage):
        notes.append(FLUX_MAP_NOTE)
    if decision.basis is not None:
        progress("the closed loop over the recording")
        read = read_recording(recording, decision.readings), read_drive(nominal, decision.readings)
        laid_over, said = _overlay(*read, improved and (improved, out / IMPROVED))
        worse = improved is not None and is_worse(laid_over, decision.fit)
        if improved is not None and worse:
            improved.unlink()
            improved, said = None, [*said, not_improved(IMPROVED, WORSE)]
        notes += said
    progress("writing the report")
    answer = worked.answer(*notes, improved=improved is not None, worse=worse)
    write_outputs(answer, stage, nominal, laid_over)
    return answer


def _listed(recordings) -> list:
    return [recordings] if isinstance(recordings, (str, os.PathLike, Recording)) else list(recordings)


def _loaded(recordings, nominal, progress) -> list[Recording]:
    loaded, refused = [], []
    for item, *beside in together_read(_listed(recordings)):
        if not isinstance(item, Recording):
            progress(f"reading {item}")
            try:
                item = load_recording(Path(item), nominal, *beside)
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


def _worked(loaded, nominal, progress, fleet=None) -> Worked:
    """The digital part, then the physics if the controller's outputs equal those of its golden model."""
    prior = placed = None
    if fleet is not None:  # imported here, as the statistics of a population take a tenth of a diagnosis to load
        from fluxproof.diagnosis.fleet import prior as population

        prior = population.load_prior(fleet, nominal.path)
    digital, notes = _digital(loaded, progress)
    nominal, differ = as_ran(nominal, loaded)
    if digital.first_difference is not None:
        found = outcome(not_compared("digital_mismatch"), loaded)
    else:
        found = _physics(loaded, nominal, progress, prior.shifts() if prior else None)
    if prior is not None:
        placed = population.among(prior, found.decision.posterior)
        notes.append(prior_note(placed, found.decision))
    if any("registers" in recording.meta for recording in loaded):
        said = [ran_with(differ)] if differ else []
    else:
        nominal, said = _untrimmed(nominal, found.decision)
    found = replace(found, problems=(*found.problems, *said))
    return Worked(found, Beside(digital, placed, tuple(notes), _reading_notes(loaded)), nominal)


def _untrimmed(nominal, decision) -> tuple[Nominal, list[Problem]]:
    """(the drive with the trims that a recording without registers was made with, findings on them)."""
    nominal, lacking = without_trims(nominal, decision.effects)
    if lacking:
        return nominal, [not_trimmed(lacking)]
    left, known = given_trims(nominal), known_effects()
    trims = any(isinstance(known.get(effect.name), MeasurementError) for effect in decision.effects)
    return nominal, [trims_unknown(left)] if left and trims else []


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


def _physics(loaded, nominal, progress, shifts) -> Outcome:
    """The decision of physics.py; a recording without a usable operating point is a bad recording."""
    try:
        return explain(loaded, nominal, progress, shifts)
    except RecordingError as error:
        problem = Problem("no_balance", str(error), fatal=True)
        # The reason of a part that was left out is a finding of another one (balance/parts.py).
        used = [recording for recording in loaded if not recording.fatal]
        return outcome(not_compared("bad_recording"), used, more=(problem,))


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
            where = {"recording": recording.source} if len(loaded) > 1 else {}
            digital = replace(digital, first_difference=flat(found.first_difference) | where)
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


def _reading_notes(loaded) -> tuple[str, ...]:
    """The notes of the readers without duplicates."""
    return tuple(dict.fromkeys(note for recording in loaded for note in recording.meta.get("notes", [])))


def _improved(nominal, decision, stage, recording, note) -> Path | None:
    """Write the improved drive if anything in it differs; note: called with why it was not written."""
    effects = to_write(read_drive(nominal, decision.readings), decision.effects, known_effects())
    if not effects and not decision.readings:
        return None
    try:
        written = write_improved(nominal, effects, stage / IMPROVED, decision.readings, recording)
        if not nominal.path or read_tables(written) != read_tables(Path(nominal.path)):
            return written
        written.unlink()
        return None
    except (DriveError, ValueError) as error:
        note(not_improved(IMPROVED, error))
        return None


def _named(file: Path, name: Path) -> Nominal:
    """The drive of a file that will have another name: files that it refers to are beside that."""
    try:
        return replace(load_nominal(file), path=str(name))
    except DriveError as error:
        raise DriveError(str(error).replace(str(file), str(name))) from None


def _overlay(recording, nominal, improved) -> tuple[dict | None, list[str]]:
    """(closed-loop simulation of the first recording, notes); a drive that cannot be simulated only adds a note.

    improved: (the improved drive's file, its name when all is written), or None.
    """
    try:
        laid_over = closed_loop(recording, nominal, _named(*improved) if improved else None)
    except (ArithmeticError, IndexError, KeyError, TypeError, ValueError) as error:  # RecordingError, DriveError too
        return None, [not_simulated(error)]
    return laid_over, loop_notes(laid_over)
