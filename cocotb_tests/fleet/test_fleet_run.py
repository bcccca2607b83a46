# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof fleet` on a small fleet: stopped and resumed, changed recordings, bad ones, killed workers, a cluster."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import urllib.request
import zipfile
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest
from distributed.scheduler import WorkerStatusPlugin

from cocotb_tests.support.fleet import small_fleet
from cocotb_tests.support.fleet.engine_work import blocking, fatal, lasting
from cocotb_tests.support.fleet.small_fleet import Here
from fluxproof.checkout import ROOT
from fluxproof.command import main
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.fleet.schema import schema
from fluxproof.fleet import engine as engines
from fluxproof.fleet import reports, table
from fluxproof.fleet.engine import Engine, Lost
from fluxproof.fleet.manifest import entries
from fluxproof.fleet.session import run
from fluxproof.fleet.watch import Watch, kill
from fluxproof.fleet.work import Item, work
from studies.fleet.figures import Killer

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}


def rows_of(out: Path) -> list[Path]:
    return sorted((out / "rows").glob("*.parquet"))


def stopped(manifest: Path, out: Path) -> int:
    """Start the command, press Ctrl-C (the terminal tells the whole group) after two rows; its exit status."""
    command = [sys.executable, "-m", "fluxproof", "fleet", str(manifest)]
    command += ["--drive", str(manifest.parent / "drive.toml")]
    done = subprocess.Popen(
        [*command, "--out", str(out), "--workers", "2", "--quiet"], cwd=ROOT, env=ENVIRONMENT, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 180
    while len(rows_of(out)) < 2 and done.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    children = psutil.Process(done.pid).children(recursive=True) if done.poll() is None else []
    with contextlib.suppress(ProcessLookupError):
        os.killpg(done.pid, signal.SIGINT)
    _, said = done.communicate(timeout=60)
    assert said == "fluxproof: stopped; the same command goes on from here\n"  # the workers are silent
    status = done.returncode
    psutil.wait_procs(children, 20)
    assert not [c for c in children if c.is_running() and c.status() != psutil.STATUS_ZOMBIE]
    return status


@contextlib.contextmanager
def cluster(folder: Path):
    """A scheduler and two workers as one starts them by hand; yields its address."""
    dask = [str(Path(sys.executable).with_name("dask"))]
    options = dict(cwd=folder, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    note = folder / "scheduler.json"
    head = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0"]
    processes = [subprocess.Popen([*dask, *head, "--scheduler-file", str(note)], **options)]
    try:
        one = ["worker", "--scheduler-file", str(note), "--nthreads", "1", "--no-dashboard"]
        processes += [subprocess.Popen([*dask, *one], **options) for _ in range(2)]
        deadline = time.monotonic() + 60
        while not note.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        yield json.loads(note.read_text())["address"]
    finally:
        for process in processes[::-1]:
            process.terminate()
        for process in processes:
            process.wait(20)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """(manifest, folder of the results) of a fleet."""
    folder = tmp_path_factory.mktemp("fleet")
    manifest, out = small_fleet.write(folder), folder / "out"
    run(listed(manifest), out, Here, quiet=True)
    return manifest, out


def listed(manifest: Path):
    return entries([str(manifest)], str(manifest.parent / "drive.toml"))


def copied(fleet, tmp_path) -> tuple[list, Path]:
    """A copy of the fleet with its results."""
    shutil.copytree(fleet[0].parent, tmp_path / "copy")
    return listed(tmp_path / "copy" / "manifest.csv"), tmp_path / "copy" / "out"


def test_every_recording_has_one_row(fleet):
    found = pq.read_table(fleet[1] / "fleet.parquet")
    assert found.schema.equals(schema()) and found.schema.metadata == schema().metadata
    rows = found.to_pylist()
    assert [r["recording"] for r in rows] == sorted(r["recording"] for r in rows)
    assert len({r["recording"] for r in rows}) == len(rows) == small_fleet.GOOD + 2
    bad = {r["recording"]: r["reason"] for r in rows if r["status"] == "failed"}
    assert set(bad) == {"empty.csv", "torn.parquet"}
    assert "the file is empty" in bad["empty.csv"] and "not a readable Parquet file" in bad["torn.parquet"]
    assert all("\n" not in reason and str(fleet[0].parent) not in reason for reason in bad.values())
    good = next(r for r in rows if r["recording"] == "drive_03.parquet")
    assert good["serial"] == "S03" and good["time"].isoformat() == "2026-01-04T08:00:00+00:00"
    assert good["temperature"] == 25.5 and dict(good["more"]) == {"station": "line 2"}
    assert {e["effect"] for h in good["hypotheses"][:1] for e in h["estimates"]} >= {"resistance", "magnet_flux"}


@pytest.mark.slow
def test_a_cluster_goes_on_where_a_run_was_stopped(fleet, tmp_path):
    folder, out = fleet[0].parent, tmp_path / "out"
    assert stopped(fleet[0], out) == 130
    before = {path: path.stat().st_mtime_ns for path in rows_of(out)}
    assert 2 <= len(before) < small_fleet.GOOD + 2 and not (out / "fleet.parquet").exists()
    assert all(pq.read_metadata(path).num_rows == 1 for path in before)
    command = ["fleet", str(fleet[0]), "--drive", str(folder / "drive.toml"), "--out", str(out)]
    with cluster(tmp_path) as address:
        assert main([*command, "--scheduler", address, "--quiet"]) == 0
    assert all(path.stat().st_mtime_ns == at for path, at in before.items())
    assert pq.read_table(out / "fleet.parquet").equals(pq.read_table(fleet[1] / "fleet.parquet"))


def test_faults_are_found_by_the_fleet(fleet):
    outcome = run(listed(fleet[0]), fleet[1], Here, quiet=True)
    assert outcome.diagnosed == 0 and outcome.failed == 2
    (design,) = outcome.findings.designs
    # A suspect beside them is a guess about what is left, and no name.
    told = {serial: {f.effect for f in found} & set(CATALOGUE) for serial, found in design.outliers.items()}
    assert told == {f"S{n:02d}": {name} for n, name in small_fleet.FAULTS.items()}


@pytest.mark.slow
def test_other_order_and_workers_give_the_same_table(fleet, tmp_path):
    """Half of the rows again, backwards, in one process; a torn row and what a killed run left are no rows."""
    some, out = copied(fleet, tmp_path)
    victims = rows_of(out)[::4]
    victims[0].write_bytes(victims[0].read_bytes()[:100])
    (out / "rows" / ".x.parquet.1.tmp").write_bytes(b"half")
    for path in victims[1:]:
        path.unlink()
    outcome = run(some[::-1], out, Here, quiet=True)
    assert outcome.diagnosed == len(victims) and not list((out / "rows").glob(".*"))
    drive = lambda t: t.drop_columns(["drive"])  # noqa: E731  the copy is in another folder
    assert drive(pq.read_table(out / "fleet.parquet")).equals(drive(pq.read_table(fleet[1] / "fleet.parquet")))


def test_what_changed_is_done_again(fleet, tmp_path):
    some, out = copied(fleet, tmp_path)
    seen = []

    class Counting(Here):
        def each(self, function, items):
            seen.extend(Path(item.recording).name for item in items)
            yield from ((item, work(item)) for item in items if False)

    changed = Path(some[1].path)
    remarked = pq.read_table(changed)
    pq.write_table(remarked.replace_schema_metadata({b"copy": b"1"}), changed)
    run(some, out, Counting, quiet=True)
    assert seen == [changed.name]
    drive = Path(some[0].drive)
    drive.write_text(drive.read_text() + "\n# another remark\n")
    seen.clear()
    run(some, out, Counting, quiet=True)
    assert sorted(seen) == sorted(Path(e.path).name for e in some)


def test_a_full_disk_stops_the_run_and_leaves_nothing_half(fleet, tmp_path, monkeypatch, capsys):
    some, out = copied(fleet, tmp_path)
    rows_of(out)[0].unlink()
    before = rows_of(out)

    def full(data, path, **_):
        Path(path).write_bytes(b"half a row")
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(table.pq, "write_table", full)
    with pytest.raises(OSError, match="No space left"):
        run(some, out, Here, quiet=True)
    assert rows_of(out) == before and not list((out / "rows").glob(".*"))


def test_a_defect_of_the_tool_costs_one_row(fleet, monkeypatch):
    monkeypatch.setattr("fluxproof.fleet.work.diagnosed", lambda *_: {}["no such key"])
    first = listed(fleet[0])[0]
    result = work(item_of(first))
    assert result.row["verdict"] == "bad_recording" and "KeyError" in result.row["reason"] and result.lasting

    def lost(*_):
        raise MemoryError("no memory")

    monkeypatch.setattr("fluxproof.fleet.work.diagnosed", lost)
    assert not work(item_of(first)).lasting  # another machine may have it


def item_of(entry) -> Item:
    return Item(entry.path, entry.drive, "key")


@pytest.mark.slow
def test_recordings_of_an_object_store(fleet, tmp_path):
    """An archive stands for an object store: both are read through fsspec."""
    archive = tmp_path / "store.zip"
    with zipfile.ZipFile(archive, "w") as store:
        for n in (1, 2):
            store.write(fleet[0].parent / f"drive_{n:02d}.parquet", f"night/drive_{n:02d}.parquet")
    drive = str(fleet[0].parent / "drive.toml")
    found = entries([f"zip://night/*.parquet::file://{archive}"], drive)
    assert [e.name.split("::")[0] for e in found] == ["zip://night/drive_01.parquet", "zip://night/drive_02.parquet"]
    outcome = run(found[:1], tmp_path / "out", Here, quiet=True)
    rows = {r["recording"]: r for r in pq.read_table(fleet[1] / "fleet.parquet").to_pylist()}
    (row,) = pq.read_table(outcome.fleet).to_pylist()
    assert row["hypotheses"] == rows["drive_01.parquet"]["hypotheses"] and row["status"] == "done"
    assert run(found[:1], tmp_path / "out", Here, quiet=True).diagnosed == 0


def test_workers_that_are_killed_lose_and_double_nothing(monkeypatch):
    monkeypatch.setitem(engines.SETTINGS, "distributed.scheduler.allowed-failures", 10)
    killer, found = Killer(2, pause_s=0.2), []
    with Engine(2) as engine, killer.around(engine):
        assert engine.dashboard.startswith("http://127.0.0.1:")
        found = list(engine.each(lasting, range(12)))
    assert killer.done == 2
    assert sorted(found) == [(n, n * n) for n in range(12)]


@pytest.mark.slow
def test_a_recording_that_takes_its_workers_with_it_is_given_up(monkeypatch):
    monkeypatch.setitem(engines.SETTINGS, "distributed.scheduler.allowed-failures", 1)
    with Engine(2) as engine:
        found = dict(engine.each(fatal, range(4)))
    assert isinstance(found.pop(2), Lost) and found == {0: 0, 1: 1, 3: 3}


def test_an_engine_ends_while_a_worker_is_started_again(monkeypatch):
    """The scheduler reports the death half a second late, when the engine is already waiting for its end."""
    begin = WorkerStatusPlugin.__init__

    def late(self, *args):
        begin(self, *args)
        self.bcomm.interval = 0.5

    monkeypatch.setattr(WorkerStatusPlugin, "__init__", late)
    with Engine(2) as engine:
        assert dict(engine.each(blocking, [0])) == {0: 0}
        worker = sorted(engine.client.nthreads())[0]
        engine.client.run(kill, [worker], workers=[worker], nanny=True)
        while worker in engine.client.nthreads():
            time.sleep(0.02)


def test_an_item_beyond_its_time_is_given_up_and_the_others_go_on():
    """One sleeps deaf to signals, one holds the interpreter's lock: only a kill from outside ends either."""
    with Engine(2, limit_s=3.0) as engine:
        found = dict(engine.each(blocking, range(6)))
    late = {n: found.pop(n) for n in (1, 3)}
    assert found == {n: n * n for n in (0, 2, 4, 5)}
    assert all(isinstance(r, Lost) and r.final and r.reason == "took longer than 3 s" for r in late.values())


def test_a_worker_is_killed_until_it_is_gone_and_what_waits_has_its_time():
    class Scheduler:
        """Its first order to a nanny is lost."""

        threads, work, killed = {"a": 1, "b": 1}, {"a": ("late", "waits"), "b": ()}, []

        def nthreads(self):
            return self.threads

        def processing(self):
            return self.work

        def run(self, function, doomed, workers, **_):
            self.killed.append(workers)

    given_up = []
    watch = Watch(Scheduler(), 10.0, given_up.append)
    for now in (0.0, 9.0, 11.0):
        watch.look(now)
    assert given_up == ["late"] and watch.client.killed == [["a"]]
    Scheduler.work = {"a": (), "b": ("waits",)}  # the item is cancelled, the worker still there
    watch.look(12.0)
    assert watch.client.killed == [["a"], ["a"]]
    Scheduler.threads = {"b": 1, "c": 1}
    watch.look(21.0)
    assert given_up == ["late"] and len(watch.client.killed) == 2


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf"])
def test_a_limit_of_time_is_more_than_nothing(seconds, capsys):
    assert main(["fleet", "run.csv", "--drive", "drive.toml", f"--timeout={seconds}"]) == 2
    assert "--timeout" in capsys.readouterr().err


def test_no_scheduler_is_one_line(fleet, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(engines, "CONNECT_S", 0.3)
    command = ["fleet", str(fleet[0]), "--drive", str(fleet[0].parent / "drive.toml"), "--out", str(tmp_path)]
    assert main([*command, "--scheduler", "tcp://127.0.0.1:9"]) == 2
    said = capsys.readouterr().err.strip()
    assert said.count("\n") == 0 and "tcp://127.0.0.1:9: no connection" in said


@pytest.mark.slow
def test_a_report_is_made_when_asked_for(fleet, tmp_path):
    some = listed(fleet[0])
    key = next(r["key"] for r in pq.read_table(fleet[1] / "fleet.parquet").to_pylist() if r["serial"] == "S03")
    address = f"reports/{key}/report.html"
    assert address in (fleet[1] / "fleet.html").read_text() and not (fleet[1] / address).exists()
    with reports.server(some, fleet[1]) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = urllib.request.urlopen(f"http://127.0.0.1:{server.server_port}/{address}").read().decode()
        server.shutdown()
    assert "<svg" in page and (fleet[1] / address).exists()
