# SPDX-License-Identifier: BSD-3-Clause
"""`make live`: does `fluxproof watch` keep up with a running drive?  Writes build/studies/live.json.

A server sends the packets of a closed loop of the golden core at 10 and 20 kHz; watch runs as a command, with its
page.  A client of the page that never reads stands for a slow browser.  One run has a wrong bit in one packet.  Then
the page is opened in a browser (page.py).

    python -m studies.live [--seconds 60]
"""

from __future__ import annotations

import argparse
import re
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

from fluxproof.checkout import BUILD, DRIVES
from fluxproof.cosim.scenarios import everything
from fluxproof.diagnosis.replay.capture import capture, packets
from fluxproof.files import write_json
from golden_model import drive as drives
from golden_model.io.telemetry_words import LAYOUT
from golden_model.registers import registers
from studies.live.browser import CHROMIUM
from studies.live.page import told

DRIVE_FILE = DRIVES / "paper001.toml"
MOST_MB = 500.0
WRONG_AT, WRONG_WORD, WRONG_BIT = 40_000, LAYOUT["i_q"].word, 3


def stream(count: int) -> np.ndarray:
    """(count, COUNT) uint32: closed loops one after the other on one core, numbered from the reset on."""
    drive = drives.load(DRIVE_FILE)
    register_set, state, parts, done = registers(drive), None, [], 0
    while done < count:
        samples, observed, state = capture(drive, register_set, everything(drive), state=state)
        parts.append(packets(samples, observed, done))
        done += len(samples)
    return np.concatenate(parts)[:count]


def send(server: socket.socket, rows: np.ndarray, rate: float) -> None:
    """All rows to one client at ``rate`` packets a second."""
    client, _ = server.accept()
    began, sent = time.monotonic(), 0
    with client:
        while sent < len(rows):
            due = min(int((time.monotonic() - began) * rate), len(rows))
            if due > sent:
                client.sendall(rows[sent:due].astype("<u4").tobytes())
                sent = due
            time.sleep(0.01)
        time.sleep(2.0)


def memory_mb(process: int) -> float:
    """Resident memory of a process."""
    text = Path(f"/proc/{process}/status").read_text()
    return sum(int(found) for found in re.findall(r"VmRSS:\s+(\d+)", text)) / 1024  # none where it has just ended


def deaf_browser(url: str) -> socket.socket:
    """A client that asks for the page and never reads the answer."""
    host, port = re.findall(r"http://([^:/]+):(\d+)/", url)[0]
    client = socket.create_connection((host, int(port)))
    client.sendall(b"GET / HTTP/1.1\r\nHost: " + f"{host}:{port}".encode() + b"\r\n\r\n")
    return client


def watch(rows: np.ndarray, rate: float) -> dict:
    """One run: what watch says at its end, its largest memory."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen(1)
        seconds = len(rows) / rate
        thread = threading.Thread(target=send, args=(server, rows, rate), daemon=True)
        thread.start()
        command = [sys.executable, "-m", "fluxproof", "watch", f"tcp://127.0.0.1:{server.getsockname()[1]}"]
        command += ["--drive", str(DRIVE_FILE), "--port", "0", "--every", "0", "--seconds", str(seconds + 10.0)]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None  # a pipe, see above
        url = child.stdout.readline()
        if "http://" not in url:
            raise RuntimeError(f"watch said {url!r} instead of the page's address")
        with deaf_browser(url):
            memory = []
            while child.poll() is None:
                memory.append(memory_mb(child.pid))
                time.sleep(1.0)
            said = child.stdout.read()
    rows_seen, lost = (int(x.replace(",", "")) for x in re.findall(r"([\d,]+) (?:rows|lost)", said)[:2])
    equal = re.findall(r"equal over ([\d,]+)", said)
    return {
        "rows": rows_seen,
        "lost": lost,
        "equal": int(equal[0].replace(",", "")) if equal else 0,
        "memory": max(memory),
        "said": said,
    }


def main() -> int:
    """Measure, print and write the figures; 1 if one misses its target."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="of each stream")
    seconds = parser.parse_args().seconds
    figures = []

    def note(figure: str, ours, target, unit: str, good: bool) -> None:
        figures.append({"figure": figure, "ours": ours, "target": target, "unit": unit, "pass": bool(good)})
        print(figures[-1], flush=True)

    for rate in (10_000, 20_000):
        rows = stream(round(rate * seconds))
        got, name = watch(rows, rate), f"{rate // 1000} kHz for {seconds:g} s"
        note(f"{name}: rows", got["rows"], len(rows), "1", got["rows"] == len(rows))
        note(f"{name}: rows lost", got["lost"], 0, "1", got["lost"] == 0)
        note(f"{name}: samples equal in every bit", got["equal"], len(rows), "1", got["equal"] == len(rows))
        note(f"{name}: largest memory", round(got["memory"]), MOST_MB, "MB", got["memory"] < MOST_MB)
    rows = stream(WRONG_AT + 20_000)
    rows[WRONG_AT, WRONG_WORD] ^= np.uint32(1 << WRONG_BIT)
    said = watch(rows, 10_000)["said"]
    wanted = f"sample {WRONG_AT}, signal i_q, bit {WRONG_BIT}"
    note("one wrong bit: told", wanted if wanted in said else said, wanted, "", wanted in said)
    out = BUILD / "studies" / "live.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    if CHROMIUM is None:
        print("no page in a browser: chromium is not installed (Debian package chromium)", file=sys.stderr)
    else:
        for figure in told(out.with_suffix(".png")):
            note(*figure)
    write_json(out, figures)
    return 0 if all(f["pass"] for f in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
