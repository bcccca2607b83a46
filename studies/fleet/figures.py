# SPDX-License-Identifier: BSD-3-Clause
"""The figures of ``make fleet``, each measured by itself: [{"figure", "ours", "target", "pass"}]."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from fluxproof.diagnosis.suspects import SUSPECTS
from fluxproof.fleet.engine import Engine
from fluxproof.fleet.manifest import entries
from fluxproof.fleet.work import Item, key_of, work
from studies.fleet import runs

LOSS = 0.02  # of the magnet flux, over the recordings of one drive
RECORDINGS = 50
KILLS = 10
TARGET_MINUTES, TARGET_BYTES = 25.0, 2e9  # of 1,000 recordings on two cores


@dataclass(frozen=True)
class Study:
    """What is measured: count of recordings, their rows, seed, kind of unknown effect, workers, folder."""

    count: int
    rows: int
    seed: int
    kind: str
    workers: int
    folder: Path

    @property
    def line(self) -> Path:
        """The folder of the fleet off the line."""
        return self.folder / f"line_{self.seed}_{self.count}_{self.rows}_{self.kind}"

    def some(self) -> int:
        """Recordings of the figures that need fewer."""
        return min(self.count, max(20, self.count * 6 // 100))


def figure(name, ours, target, passed) -> dict:
    return {"figure": name, "ours": ours, "target": target, "pass": bool(passed)}


def production(study: Study):
    """(truth of the fleet off the line, outcome of the run over it, its folder)."""
    truths = runs.production(study.line, study.seed, study.count, study.rows, study.kind, study.workers)
    out = study.line / "out"
    return truths, runs.diagnosed(study.line / "manifest.csv", out, study.workers), out


def thousand(study: Study) -> list[dict]:
    """Time and memory of the whole fleet."""
    _, _, out = production(study)
    seen = runs.wall(out)
    minutes = seen["seconds"] / seen["recordings"] * 1000 / 60
    measured = f"{minutes:.1f} min, {seen['bytes'] / 1e9:.2f} GB; {seen['recordings']} recordings measured"
    name = f"1,000 recordings of {study.rows} rows, {study.workers} workers"
    passed = minutes <= TARGET_MINUTES and seen["bytes"] <= TARGET_BYTES
    return [figure(name, measured, "<= 25 min, <= 2 GB in all", passed)]


def hidden(study: Study) -> list[dict]:
    """Hidden faults found with the right cause, and drives that are blamed wrongly."""
    truths, outcome, _ = production(study)
    told = causes(outcome)
    faulty = {t["serial"]: t["name"] for t in truths if t["role"] == "fault"}
    right = [s for s, name in faulty.items() if told.get(s) == {name}]
    false = {s: sorted(names) for s, names in told.items() if s not in faulty}
    missed = {s: f"{name} as {sorted(told.get(s, set())) or 'nothing'}" for s, name in faulty.items() if s not in right}
    least = int(np.ceil(29 / 30 * len(faulty))) if len(faulty) >= 30 else len(faulty)
    most = int(np.floor(2 / 1000 * study.count))
    ours = f"{len(right)} of {len(faulty)} found with the right cause, {len(false)} false"
    ours += f"; missed: {missed}" if missed else ""
    ours += f"; false: {false}" if false else ""
    name = f"{len(faulty)} hidden faulty drives among {study.count}, spread +-5 %"
    target = f">= {least} found with the right cause, <= {most} false"
    return [figure(name, ours, target, len(right) >= least and len(false) <= most)]


def causes(outcome) -> dict[str, set[str]]:
    """{serial: effects of the catalogue that it is told to differ by}; what no parameter carries is no cause."""
    out = {}
    for design in outcome.findings.designs:
        for serial, found in design.outliers.items():
            names = {f.effect for f in found} - set(SUSPECTS)
            if names:
                out[serial] = names
    return out


def group(study: Study) -> list[dict]:
    """The effect outside of the catalogue as one group."""
    truths, outcome, _ = production(study)
    strange = {t["serial"] for t in truths if t["role"] == "unknown"}
    groups = [set(g.serials) for design in outcome.findings.designs for g in design.groups]
    best = max(groups, key=lambda g: len(g & strange), default=set())
    beside = len(best - strange)
    ours = f"{len(best & strange)} of {len(strange)} in one group with {beside} others; {len(groups)} groups in all"
    name = f"an effect outside the catalogue ({study.kind}) in {len(strange)} of {study.count}"
    return [figure(name, ours, "found as one group", strange <= best and not beside)]


def cost(study: Study) -> list[dict]:
    """Cost against the number of recordings: ten recordings, copied under other contents, so that all cost the same."""
    runs.production(study.line, study.seed, study.count, study.rows, study.kind, study.workers)
    listed = [e for e in entries([str(study.line / "manifest.csv")], None)][:10]
    numbers = sorted({10, *(round(10**x) for x in (1.5, 2.0, 2.5)), study.count})
    numbers = [n for n in numbers if n <= study.count]
    seconds = []
    for number in numbers:
        folder = study.folder / f"copies_{study.seed}_{study.rows}_{number}"
        if not (folder / "out" / "fleet.html").exists():  # a run that was stopped has no time of its own
            shutil.rmtree(folder, ignore_errors=True)
            copies(listed, folder, number)
            runs.diagnosed(folder / "manifest.csv", folder / "out", study.workers)
        seconds.append(runs.wall(folder / "out")["seconds"])
    n, t = np.array(numbers, float), np.array(seconds)
    (start, each), *_ = np.linalg.lstsq(np.stack([1.0 / t, n / t], axis=1), np.ones(len(n)), rcond=None)
    off = float(np.max(np.abs(1.0 - (start + each * n) / t)))
    table = ", ".join(f"{a}: {b:.0f} s" for a, b in zip(numbers, seconds, strict=True))
    ours = f"within {100 * off:.1f} % of {start:.1f} s + {each:.3f} s per recording ({table})"
    enough = len(numbers) >= 3
    name = f"cost against number of recordings, 10 to {study.count}"
    return [figure(name, ours, "linear within 10 %", enough and off <= 0.1)]


def copies(listed, folder: Path, number: int) -> None:
    """``number`` recordings that differ in a remark of their file alone."""
    folder.mkdir(parents=True)
    shutil.copy(listed[0].drive, folder / "drive.toml")
    lines = []
    for n in range(number):
        table = pq.read_table(listed[n % len(listed)].path)
        name = f"copy_{n:05d}.parquet"
        remark = {**(table.schema.metadata or {}), b"copy": str(n).encode()}
        pq.write_table(table.replace_schema_metadata(remark), folder / name)
        lines.append((name, f"C{n:05d}", ""))
    runs.manifest(folder / "manifest.csv", lines)


def speedup(study: Study) -> list[dict]:
    """Time of the same recordings on one and on two workers that are warm."""
    runs.production(study.line, study.seed, study.count, study.rows, study.kind, study.workers)
    listed = entries([str(study.line / "manifest.csv")], None)[: study.some()]
    items = [Item(e.path, e.drive, key_of(e.path, e.drive)) for e in listed]
    seconds = {}
    for workers in (1, 2):
        with Engine(workers) as engine:
            list(engine.each(work, items[: 4 * workers]))  # imports and compiled code
            began = time.perf_counter()
            list(engine.each(work, items))
            seconds[workers] = time.perf_counter() - began
    ratio = seconds[1] / seconds[2]
    ours = f"{ratio:.2f} ({len(items)} recordings: {seconds[1]:.0f} s and {seconds[2]:.0f} s)"
    return [figure("speed-up from one to two workers", ours, ">= 1.8", ratio >= 1.8)]


def ageing(study: Study):
    """(truths, outcome) of the recordings of one drive over its life."""
    folder = study.folder / f"life_{study.seed}_{study.rows}"
    truths = runs.life(folder, study.seed, RECORDINGS, LOSS, study.rows, study.workers)
    return truths, runs.diagnosed(folder / "manifest.csv", folder / "out", study.workers)


def drift(study: Study) -> list[dict]:
    """A loss of magnet flux over the recordings of one drive."""
    _, outcome = ageing(study)
    found = [d for design in outcome.findings.designs for d in design.drifts]
    mine = next((d for d in found if d.parameter == "magnet_flux_wb"), None)
    others = sorted({d.parameter for d in found} - {"magnet_flux_wb"})
    target = "rate within 10 %, noticed before 1 %"
    name = f"a {100 * LOSS:g} % loss of magnet flux over {RECORDINGS} recordings of one drive"
    if mine is None:
        return [figure(name, "not found", target, False)]
    days = (mine.times[-1] - mine.times[0]).total_seconds() / 86400.0
    error = mine.line.b * days / mine.line.a / -LOSS - 1.0
    at = LOSS * mine.noticed / (RECORDINGS - 1) if mine.noticed is not None else float("nan")
    ours = f"rate {100 * error:+.1f} %, noticed at a loss of {100 * at:.2f} %; other drifts told: {others or 'none'}"
    return [figure(name, ours, target, abs(error) <= 0.1 and at < 0.01)]


def killed(study: Study) -> list[dict]:
    """The same table with workers killed during the run."""
    runs.production(study.line, study.seed, study.count, study.rows, study.kind, study.workers)
    listed = entries([str(study.line / "manifest.csv")], None)[: study.some()]
    source = study.folder / f"killed_{study.seed}" / "manifest.csv"
    source.parent.mkdir(parents=True, exist_ok=True)
    lines = [(os.path.relpath(e.path, source.parent), e.serial, "") for e in listed]
    shutil.copy(listed[0].drive, source.parent / "drive.toml")
    runs.manifest(source, lines)
    calm, rough = source.parent / "calm", source.parent / "rough"
    shutil.rmtree(rough, ignore_errors=True)
    runs.diagnosed(source, calm, study.workers)
    killer = Killer(KILLS)
    runs.diagnosed(source, rough, study.workers, killer.around)
    tables = [pq.read_table(folder / "fleet.parquet") for folder in (calm, rough)]
    same, count = tables[0].equals(tables[1]), tables[1].num_rows
    names = tables[1].column("recording").to_pylist()
    whole = len(set(names)) == count == len(listed) and not _failed(tables[1])
    ours = f"{killer.done} kills, {count} rows of {len(listed)}, {'the same table' if same else 'ANOTHER TABLE'}"
    return [figure(f"a worker killed {KILLS} times during a run", ours, "same table, nothing lost or doubled",
                   same and whole and killer.done == KILLS)]  # fmt: skip


def _failed(table: pa.Table) -> int:
    return sum(status != "done" for status in table.column("status").to_pylist())


class Killer:
    """Kills a worker process of an engine of this machine again and again, each time one that is at work."""

    def __init__(self, kills: int, pause_s: float = 1.0):
        self.kills, self.pause_s, self.done = kills, pause_s, 0

    @contextlib.contextmanager
    def around(self, engine):
        over = threading.Event()
        thread = threading.Thread(target=self._run, args=(engine, over), daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def _run(self, engine, over):
        last = None
        while self.done < self.kills and not over.wait(self.pause_s):
            busy = {address for address, tasks in _processing(engine).items() if tasks}
            pids = sorted(n.pid for n in engine.cluster.workers.values() if n.worker_address in busy and n.pid)
            pid = next((p for p in pids if p != last), None)
            if pid is not None:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                    self.done, last = self.done + 1, pid


def _processing(engine) -> dict:
    """{address of a worker: tasks that it has}; empty while the cluster closes."""
    try:
        return engine.client.processing()
    except (OSError, RuntimeError, ValueError):
        return {}


FIGURES = {f.__name__: f for f in (thousand, cost, speedup, hidden, drift, group, killed)}
