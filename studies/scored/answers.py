# SPDX-License-Identifier: BSD-3-Clause
"""Diagnose files as a user does, and keep each answer for as long as files and code are the same."""

from __future__ import annotations

import hashlib
import json
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.session import run
from fluxproof.files import write_json
from fluxproof.fleet.engine import in_parallel
from fluxproof.fleet.work import version
from golden_model.drive_file import read_tables
from golden_model.drive_keys import DriveError

LEFT_OUT = ("digital", "prior", "location", "fit")  # of diagnosis.json, as no judgement rests on them


@dataclass(frozen=True)
class Job:
    """recordings: of one drive; out: folder of the whole result, None: the answer alone; kept: file of the answer."""

    name: str
    recordings: tuple[Path, ...]
    drive: Path
    out: Path | None
    kept: Path


def job_of(name, recordings, drive, out, folder) -> Job:
    """A job whose answer is kept in ``folder`` under a hash of its files and of the code."""
    state = hashlib.sha256(version().encode())
    for path in (*recordings, drive):
        state.update(Path(path).read_bytes())
    return Job(name, tuple(recordings), drive, out, folder / f"{name}_{state.hexdigest()[:16]}.json")


def answer_of(job: Job) -> dict:
    """The answer of one job; {"refused": message} of unusable input, {"crash": error} of a defect of the tool."""
    began = time.process_time()
    try:
        if job.out is None:
            answer = diagnose(list(job.recordings), job.drive).to_json()
        else:
            run(list(job.recordings), job.drive, job.out)
            answer = json.loads((job.out / "diagnosis.json").read_text())
            answer["improved"] = _improved(job.drive, job.out / "drive_improved.toml")
    except (RecordingError, DriveError) as error:
        answer = {"refused": str(error)}
    except Exception as error:  # the study counts exceptions and continues
        answer = {"crash": f"{type(error).__name__}: {error}", "trace": traceback.format_exc(limit=-4)}
    answer = {key: value for key, value in answer.items() if key not in LEFT_OUT}
    answer["seconds"] = round(time.process_time() - began, 2)
    text = json.dumps(answer, default=float).replace(f"{Path(job.recordings[0]).parent}/", "")
    answer = json.loads(text)
    write_json(job.kept, answer)
    return answer


def _improved(given: Path, file: Path) -> str | None:
    """Whether an improved drive file changes anything: "same", "changed"; None if there is none."""
    if not file.exists():
        return None
    return "same" if read_tables(given) == read_tables(file) else "changed"


def answers(jobs: list[Job], workers: int) -> Iterator[tuple[Job, dict]]:
    """(job, answer) of all jobs as they end; what an earlier run has finished is read."""
    left = []
    for job in jobs:
        if job.kept.exists():
            yield job, json.loads(job.kept.read_text())
        else:
            left.append(job)
    if workers == 1:
        yield from ((job, answer_of(job)) for job in left)
    else:
        yield from in_parallel(answer_of, left, workers, "diagnosed")


def kept_answers(jobs: list[Job]) -> Iterator[tuple[Job, dict]]:
    """(job, newest answer that is kept), also of other code; without those that have none."""
    for job in jobs:
        name = job.kept.stem.rpartition("_")[0]
        files = [p for p in job.kept.parent.glob("*.json") if p.stem.rpartition("_")[0] == name]
        if files:
            yield job, json.loads(max(files, key=lambda p: p.stat().st_mtime).read_text())
