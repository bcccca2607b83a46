# SPDX-License-Identifier: BSD-3-Clause
"""The page over the core in Verilator, with three events planted (core.py): is each told, and rightly?

The page is read as a user would.  An event is planted when the page has told the one before, the first when it has
explained the drive without it; the run lasts as long as it is asked to at least, and as long as a busy machine needs.
build/studies/live_events.png shows the page after the resistance was named.
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

KEEP_ROWS, EVERY_S, LOOK_S = 7000, 5.0, 0.5
MOST_S = 3000.0  # for one explanation
LINE = ("position", "encoder_lost")  # the faults that a code which stands still is told by
Figure = tuple[str, object, object, str, bool]  # figure, ours, target, unit, good


class Reader:
    """What the page has said: {sample: explanation up to it}, and its text now."""

    def __init__(self, page: Browser) -> None:
        self.page, self.text, self.explained = page, "", {}

    def look(self) -> None:
        time.sleep(LOOK_S)
        self.text = re.sub(r":host\{.*?(?=to sample|$)", " ", self.page.js(TEXT))
        for number, said in re.findall(r"to sample (\d+): (.*?s\))", self.text):
            self.explained[int(number)] = said

    @property
    def rows(self) -> int:
        found = re.search(r"([\d,]+) rows", self.text)
        return int(found.group(1).replace(",", "")) if found else 0

    def until(self, done, seconds: float) -> bool:
        """Whether ``done()`` came to be within ``seconds``."""
        end = time.monotonic() + seconds
        while not done() and time.monotonic() < end:
            self.look()
        return bool(done())


def planted(seconds: float, picture: Path) -> list[Figure]:
    """The figures of a run of ``seconds`` or more."""
    with tempfile.TemporaryDirectory() as scratch:
        folder, port = Path(scratch), free_port()
        uio, drive = folder / "uio", slow_drive(folder / "drive.toml")
        uio.write_bytes(bytes(4096))
        command = [str(build_server(folder)), "-", str(port), "127.0.0.1", str(uio)]
        server = subprocess.Popen(command, stdin=subprocess.PIPE)
        command = [sys.executable, "-m", "fluxproof", "watch", f"tcp://127.0.0.1:{port}", "--port", "0"]
        command += ["--drive", str(drive), "--keep", str(KEEP_ROWS * 1e-4), "--every", str(EVERY_S)]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None and server.stdin is not None  # pipes, see above
        try:
            url = child.stdout.readline().split()[-1]
            core = subprocess.Popen(
                [sys.executable, "-m", "studies.live.core", str(drive), f"--uio={uio}"],
                stdin=subprocess.PIPE, stdout=server.stdin, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            server.stdin.close()
            with Browser(url, folder, height=920) as page:
                read = Reader(page)
                lasted = _story(read, core, seconds, picture)
                answer = core.communicate("end\n", timeout=MOST_S)[1]
        finally:
            for process in (child, server):
                process.terminate()
                process.wait()
    return judged(read, json.loads(answer.strip().splitlines()[-1]), lasted, seconds)


def _story(read: Reader, core: subprocess.Popen, seconds: float, picture: Path) -> float:
    """Plant one event after the other; how long it took [s]."""
    orders = core.stdin
    assert orders is not None  # a pipe

    def plant() -> None:
        orders.write("next\n")
        orders.flush()

    read.until(lambda: read.rows > 0, MOST_S)  # the core is compiled
    begin = time.monotonic()
    read.until(lambda: any(number > KEEP_ROWS for number in read.explained), MOST_S)
    plant()
    since = read.rows
    read.until(lambda: any(number > since + KEEP_ROWS + 500 for number in read.explained), MOST_S)
    read.page.picture(picture)
    read.until(lambda: time.monotonic() - begin > 0.95 * seconds, seconds)
    plant()
    read.until(lambda: "gates off: " in read.text, 120.0)
    plant()
    read.until(lambda: f"bit {WRONG_BIT}" in read.text, 120.0)
    return time.monotonic() - begin


def judged(read: Reader, at: dict[str, int], lasted: float, seconds: float) -> list[Figure]:
    """What the page said against what was planted."""
    before = [said for number, said in read.explained.items() if number < at["resistance"]]
    after = [said for number, said in read.explained.items() if at["resistance"] + KEEP_ROWS <= number < at["line"]]
    named = [said for said in after if said.startswith("explained: ") and "esistance" in said]
    quiet = [said for said in before if "esistance" in said]
    line = re.findall(rf"sample (\d+): gates off: ({'|'.join(LINE)})", read.text)
    told = f"sample {at['bit']}, signal {WRONG_SIGNAL}, bit {WRONG_BIT}"
    equal = f"{at['bit']:,} samples before it are equal"
    return [
        ("events: the core in Verilator ran for", round(lasted), round(seconds), "s", lasted >= 0.9 * seconds),
        ("events: its samples", at["end"] + 1, "", "1", True),
        (
            "events: explanations before it that name it",
            len(quiet),
            0,
            f"of {len(before)}",
            bool(before) and not quiet,
        ),
        (f"events: resistance times {RESISTANCE}", (after or [""])[-1], "Resistance", "", bool(named)),
        ("events: explanations of it that name it", len(named), len(after), "1", 0 < len(named) == len(after)),
        ("events: lost line of the encoder", line[:1], f"sample {at['line']}", "", bool(line)),
        ("events: one wrong bit", told if told in read.text else "", told, "", told in read.text),
        ("events: equal before it", equal if equal in read.text else "", equal, "", equal in read.text),
    ]
