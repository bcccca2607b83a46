# SPDX-License-Identifier: BSD-3-Clause
"""`make live`: does `fluxproof watch` keep up with a running drive?  Writes build/studies/live.json.

Closed loops of the golden core (drive.py) at 10 and 20 kHz, side by side, through docs/software/telemetry_server.c,
which leaves out rows where its client is too slow; watch runs as a command, with its page and its explanation.  A
session of the page whose answers nobody reads stands for a slow browser; what is explained is of no interest, since no
plant answers.  One run has a wrong bit in one packet.  Then the page is opened in a browser (page.py), and if it is
asked for, the core in Verilator runs with three events (events.py).

    python -m studies.live [--seconds 60] [--events 600]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from bokeh.client import pull_session

from fluxproof.checkout import BUILD
from fluxproof.files import write_json
from studies.live.browser import CHROMIUM
from studies.live.drive import DRIVE_FILE, WRONG_BIT, WRONG_SIGNAL
from studies.live.events import planted
from studies.live.page import told
from studies.live.server import build_server, free_port

RATES = 10_000, 20_000
MOST_MB, MOST_GROWTH_MB = 700.0, 20.0  # an explanation copies the rows in memory, twenty seconds here
SETTLED = 0.25  # part of a run after which the rows in memory are as many as `--keep` allows
READINGS = 10  # of the memory, first to last
WRONG_AT = 40_000
EVERY_S, DRAIN_S, TOLD_S = 20.0, 20.0, 300


class Run(NamedTuple):
    """What one run of watch has shown."""

    sent: dict[str, float]  # rows, seconds, stood: see drive.py
    rows: int
    lost: int
    equal: int
    memory: list[float]  # [MB], a reading each second
    processor: float  # share of one core
    load: float  # mean load of the machine
    said: str


def memory_mb(process: int) -> float:
    """Resident memory of a process."""
    text = Path(f"/proc/{process}/status").read_text()
    return sum(int(found) for found in re.findall(r"VmRSS:\s+(\d+)", text)) / 1024  # none where it has just ended


def processor_s(process: int) -> float:
    """Seconds of the processor that a process has used."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def watch(server_program: Path, rate: int, rows: int, wrong_at: int = -1) -> Run:
    """One run: the drive, the server, watch, and a session of its page that nobody reads."""
    port, seconds = free_port(), rows / rate
    server = subprocess.Popen([server_program, "-", str(port)], stdin=subprocess.PIPE)
    command = [sys.executable, "-m", "fluxproof", "watch", f"tcp://127.0.0.1:{port}", "--drive", str(DRIVE_FILE)]
    command += ["--port", "0", "--every", str(max(EVERY_S, seconds / 12))]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and server.stdin is not None  # pipes, see above
    try:
        url = child.stdout.readline().split()[-1]
        if not url.startswith("http://"):
            raise RuntimeError(f"watch said {url!r} instead of the page's address")
        deaf = pull_session(url=url)  # its loop never runs again: what the page sends stays in the socket
        time.sleep(2.0)  # the server has its client
        drive = subprocess.Popen(
            [sys.executable, "-m", "studies.live.drive", f"--rate={rate}", f"--rows={rows}", f"--wrong-at={wrong_at}"],
            stdout=server.stdin, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        server.stdin.close()
        memory, load, began, used = [], [], time.monotonic(), processor_s(child.pid)
        while drive.poll() is None:
            memory.append(memory_mb(child.pid))
            load.append(os.getloadavg()[0])
            if len(memory) % TOLD_S == 0:
                print(f"{rate} Hz: {len(memory)} s, {memory[-1]:.0f} MB, load {load[-1]:.1f}", file=sys.stderr)
            time.sleep(1.0)
        processor = (processor_s(child.pid) - used) / (time.monotonic() - began)
        assert drive.stderr is not None
        sent = json.loads(drive.stderr.read().strip().splitlines()[-1])
        server.wait(DRAIN_S)
        time.sleep(2.0)
        child.send_signal(signal.SIGINT)
        said = child.stdout.read()
        child.wait(DRAIN_S)
        del deaf
    finally:
        server.kill()
        child.kill()
    seen, lost = (int(x.replace(",", "")) for x in re.findall(r"([\d,]+) (?:rows|lost)", said)[:2])
    equal = re.findall(r"equal over ([\d,]+)", said)
    count = int(equal[0].replace(",", "")) if equal else 0
    return Run(sent, seen, lost, count, memory, processor, sum(load) / len(load), said)


def main() -> int:
    """Measure, print and write the figures; 1 if one misses its target."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="of the streams")
    parser.add_argument("--events", type=float, default=0.0, help="seconds of the core in Verilator (0: left out)")
    args = parser.parse_args()
    seconds, events = args.seconds, args.events
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job of a shell ignores it, as its children
    figures = []

    def note(figure: str, ours, target, unit: str, good: bool) -> None:
        figures.append({"figure": figure, "ours": ours, "target": target, "unit": unit, "pass": bool(good)})
        print(figures[-1], flush=True)

    if shutil.which("cc") is None:
        print("a C compiler is needed for docs/software/telemetry_server.c", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as scratch:
        server = build_server(Path(scratch))
        with ThreadPoolExecutor() as pool:
            runs = list(pool.map(lambda rate: watch(server, rate, round(rate * seconds)), RATES))
        wrong = watch(server, RATES[0], WRONG_AT + 20_000, WRONG_AT).said
    for rate, run in zip(RATES, runs, strict=True):
        name, rows = f"{rate // 1000} kHz for {seconds:g} s", round(rate * seconds)
        settled = run.memory[round(SETTLED * len(run.memory)) :]
        steps = [run.memory[k * (len(run.memory) - 1) // (READINGS - 1)] for k in range(READINGS)]
        kept = rows / run.sent["seconds"]
        note(f"{name}: rows", run.rows, rows, "1", run.rows == rows)
        note(f"{name}: rows lost", run.lost, 0, "1", run.lost == 0)
        note(f"{name}: samples equal in every bit", run.equal, rows, "1", run.equal == rows)
        note(f"{name}: rate over the run", round(kept / 1000, 2), rate / 1000, "kHz", kept >= 0.98 * rate)
        note(f"{name}: memory, first to last", [round(m) for m in steps], MOST_MB, "MB", max(run.memory) < MOST_MB)
        grown = max(settled[-max(1, len(settled) // 4) :]) - max(settled[: max(1, len(settled) // 4)])
        note(f"{name}: growth after the rows are full", round(grown, 1), MOST_GROWTH_MB, "MB", grown < MOST_GROWTH_MB)
        note(f"{name}: processor of watch", round(run.processor, 2), 1.0, "cores", run.processor < 1.0)
        note(f"{name}: mean load of the machine", round(run.load, 1), "", "processes", True)
    wanted = f"sample {WRONG_AT}, signal {WRONG_SIGNAL}, bit {WRONG_BIT}"
    note("one wrong bit: told", wanted if wanted in wrong else wrong, wanted, "", wanted in wrong)
    out = BUILD / "studies" / "live.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    if CHROMIUM is None:
        print("no page in a browser: chromium is not installed (Debian package chromium)", file=sys.stderr)
    else:
        for figure in told(out.with_suffix(".png")):
            note(*figure)
        if events > 0.0 and shutil.which("verilator"):
            for figure in planted(events, out.with_name("live_events.png")):
                note(*figure)
    write_json(out, figures)
    return 0 if all(f["pass"] for f in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
