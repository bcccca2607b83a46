# SPDX-License-Identifier: BSD-3-Clause
"""Fleets on disk and runs over them, each resumable, with the wall time and the memory that they took."""

from __future__ import annotations

import contextlib
import csv
import datetime
import io
import json
import threading
import time
from pathlib import Path

import psutil

from fluxproof.files import write_json, write_text
from fluxproof.fleet.engine import Engine, in_parallel
from fluxproof.fleet.manifest import entries
from fluxproof.fleet.session import Outcome, run
from studies.fleet import drives

START = datetime.datetime(2026, 1, 5, tzinfo=datetime.timezone.utc)
WEEK = datetime.timedelta(days=7)


def made(function, jobs, what, workers) -> list[dict]:
    """The truths of all recordings, in the order of the jobs; those that exist are not simulated again."""
    todo = [job for job in jobs if not drives.recording_of(job).exists()]
    for _ in in_parallel(function, todo, workers, what):
        pass
    return [function(job) for job in jobs]


def production(folder: Path, seed: int, count: int, rows: int, kind: str, workers: int) -> list[dict]:
    """A fleet off a line in ``folder`` with its manifest.csv; returns the truth of each drive."""
    nominal = drives.design_of(seed)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "drive.toml", nominal.toml())
    chosen = drives.roles(seed, count, kind)
    jobs = [(nominal, seed, n, role, name, rows, folder) for n, (role, name) in enumerate(chosen)]
    truths = made(drives.written, jobs, "simulated", workers)
    manifest(folder / "manifest.csv", [(t["recording"], t["serial"], "") for t in truths])
    return truths


def life(folder: Path, seed: int, count: int, loss: float, rows: int, workers: int) -> list[dict]:
    """Weekly recordings of one drive that loses the share ``loss`` of its flux, and its manifest.csv."""
    nominal = drives.design_of(seed)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "drive.toml", nominal.toml())
    shares = [1.0 - loss * n / (count - 1) for n in range(count)]
    jobs = [(nominal, seed, s, n, rows, folder) for n, s in enumerate(shares)]
    truths = made(drives.ageing, jobs, "simulated", workers)
    lines = [(t["recording"], "A1", (START + n * WEEK).isoformat()) for n, t in enumerate(truths)]
    manifest(folder / "manifest.csv", lines)
    return truths


def manifest(path: Path, lines) -> None:
    text = io.StringIO()
    csv.writer(text).writerows([("recording", "serial", "time", "drive"), *((*line, "drive.toml") for line in lines)])
    write_text(path, text.getvalue())


def diagnosed(source: Path, out: Path, workers: int, disturb=lambda engine: contextlib.nullcontext()) -> Outcome:
    """Run the command's session over a manifest; OUT/wall.json sums up wall time, memory and recordings of all runs.

    disturb: a context around the run, given the engine.
    """
    out.mkdir(parents=True, exist_ok=True)
    note = out / "wall.json"
    before = json.loads(note.read_text()) if note.exists() else {"seconds": 0.0, "recordings": 0, "bytes": 0}
    listed, began = entries([str(source)], None), time.perf_counter()
    with contextlib.ExitStack() as stack, Memory() as memory:
        outcome = run(listed, out, lambda: Engine(workers), told=lambda engine: stack.enter_context(disturb(engine)))
    if outcome.diagnosed:
        write_json(note, {
            "seconds": before["seconds"] + time.perf_counter() - began,
            "recordings": before["recordings"] + outcome.diagnosed,
            "bytes": max(before["bytes"], memory.most),
        })  # fmt: skip
    return outcome


def wall(out: Path) -> dict:
    """{"seconds", "recordings", "bytes"} of the runs into a folder."""
    return json.loads((out / "wall.json").read_text())


class Memory:
    """The largest memory of this process and its children, sampled twice a second."""

    def __enter__(self):
        self.most, self.over = 0, threading.Event()
        self.thread = threading.Thread(target=self._watch, daemon=True)
        self.thread.start()
        return self

    def _watch(self):
        me = psutil.Process()
        while not self.over.wait(0.5):
            total = 0
            for process in [me, *me.children(recursive=True)]:
                with contextlib.suppress(psutil.Error):
                    total += process.memory_info().rss
            self.most = max(self.most, total)

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()
