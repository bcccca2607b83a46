# SPDX-License-Identifier: BSD-3-Clause
"""The page over the core in Verilator, with three events planted (core.py): is each told, and rightly?

The page is read as a user would; build/studies/live_events.png shows it after the resistance was named.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from studies.live.browser import TEXT, Browser
from studies.live.core import RESISTANCE, WRONG_BIT, WRONG_SIGNAL, slow_drive
from studies.live.server import build_server, free_port

KEEP_S, EVERY_S, LOOK_S, BUILD_S = 0.7, 5.0, 0.5, 1800.0
Figure = tuple[str, object, object, str, bool]  # figure, ours, target, unit, good
LINE = ("position", "encoder_lost")  # the faults that a code which stands still is told by


def planted(seconds: float, picture: Path) -> list[Figure]:
    """The figures of a run of ``seconds``."""
    with tempfile.TemporaryDirectory() as scratch:
        folder, port = Path(scratch), free_port()
        uio, drive = folder / "uio", slow_drive(folder / "drive.toml")
        uio.write_bytes(bytes(4096))
        command = [str(build_server(folder)), "-", str(port), "127.0.0.1", str(uio)]
        server = subprocess.Popen(command, stdin=subprocess.PIPE)
        command = [sys.executable, "-m", "fluxproof", "watch", f"tcp://127.0.0.1:{port}", "--port", "0"]
        command += ["--drive", str(drive), "--keep", str(KEEP_S), "--every", str(EVERY_S)]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None and server.stdin is not None  # pipes, see above
        try:
            url = child.stdout.readline().split()[-1]
            core = subprocess.Popen(
                [sys.executable, "-m", "studies.live.core", f"--seconds={seconds}", f"--uio={uio}", str(drive)],
                stdout=server.stdin, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            server.stdin.close()
            with Browser(url, folder, height=1400) as page:
                said, seen = [], ""
                page.until(f"/[1-9][0-9]* rows/.test({TEXT})", BUILD_S)
                begin, pictured = time.monotonic(), False
                while core.poll() is None or server.poll() is None:
                    if (now := page.js(TEXT)) != seen:
                        said.append((time.monotonic() - begin, now))
                        seen = now
                    if not pictured and re.search(r"explained: [^<]*esistance", seen):
                        page.picture(picture)
                        pictured = True
                    time.sleep(LOOK_S)
                page.until(f"{TEXT}.includes('bit {WRONG_BIT}')", 30.0)
                said.append((time.monotonic() - begin, page.js(TEXT)))
        finally:
            for process in (child, server):
                process.terminate()
                process.wait()
        assert core.stderr is not None
        at = json.loads(core.stderr.read().strip().splitlines()[-1])
    return judged(said, at, seconds)


def judged(said: list[tuple[float, str]], at: dict[str, int], seconds: float) -> list[Figure]:
    """What the page said against what was planted."""
    texts = " ".join(text for _, text in said)
    found = sorted({(int(n), what) for n, what in re.findall(r"to sample (\d+): (.*?)(?= ?to sample \d|$)", texts)})
    whole = round(KEEP_S / 1e-4)
    before = [what for n, what in found if n < at["resistance"]]
    after = [what for n, what in found if at["resistance"] + whole < n < at["line"]]
    named = [what for what in after if what.startswith("explained: ") and "esistance" in what]
    line = re.findall(rf"sample (\d+): gates off: ({'|'.join(LINE)})", texts)
    told = f"sample {at['bit']}, signal {WRONG_SIGNAL}, bit {WRONG_BIT}"
    quiet = [what for what in before if "esistance" in what]
    equal = f"{at['bit']:,} samples before it are equal"
    return [
        ("events: run", round(said[-1][0]), round(seconds), "s", said[-1][0] >= 0.9 * seconds),
        ("events: samples of the core in Verilator", at["samples"], "", "1", at["samples"] > 0),
        ("events: explanations before the first, with a resistance", len(quiet), 0, f"of {len(before)}", not quiet),
        (f"events: resistance times {RESISTANCE}, told", named[-1] if named else after[-1:], "", "", bool(named)),
        ("events: explanations of it, right", len(named), len(after), "1", 0 < len(named) == len(after)),
        ("events: lost line of the encoder, told", line[:1], f"sample {at['line']}", "", bool(line)),
        ("events: one wrong bit, told", told if told in texts else "", told, "", told in texts),
        ("events: equal before it", equal if equal in texts else "", equal, "", equal in texts),
    ]
