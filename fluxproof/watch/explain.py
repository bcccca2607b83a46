# SPDX-License-Identifier: BSD-3-Clause
"""Why the last seconds differ from the simulation: `fluxproof diagnose` over them, again and again, in a process of its
own, so that neither the reader nor the page waits for it."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterable, Mapping
from pathlib import Path
from threading import Event
from types import MappingProxyType
from typing import NamedTuple

from fluxproof.diagnosis.replay.telemetry import write_dump
from fluxproof.watch.live import Live
from golden_model import fluxproof
from golden_model.drive import Drive
from golden_model.io.telemetry_words import PACKET
from golden_model.registers import RegisterSet

FEWEST_ROWS = 2000
PATIENCE_S = 600.0  # a busy machine: the process runs below all others, and nobody waits for it
KEPT = 100  # explanations, for their size over time


class Explanation(NamedTuple):
    """What the diagnosis says of the rows up to a sample.

    sizes: {"effect: parameter": (value, sigma, unit)} of what it names.
    """

    counter: int
    verdict: str
    text: str
    sizes: Mapping[str, tuple[float, float, str]] = MappingProxyType({})


class Explainer:
    """Renews the explanation while rows come."""

    def __init__(self, live: Live, drive: Drive, path: str, register_set: RegisterSet, every_s: float) -> None:
        self.live, self.drive, self.path, self.register_set, self.every_s = live, drive, path, register_set, every_s
        self.found: deque[Explanation] = deque(maxlen=KEPT)
        self.seen = 0  # rows that the last explanation knew of

    def run(self, ending: Event) -> None:
        """Until ``ending``; once more every ``every_s`` if rows have come."""
        while not ending.wait(self.every_s):
            if self.live.total - self.seen >= FEWEST_ROWS:
                self.seen = self.live.total
                try:
                    self.found.append(self.explain())
                except (OSError, ValueError, KeyError) as error:  # the reader goes on
                    self.found.append(Explanation(self.live.last or 0, "none", f"no diagnosis: {error}"))

    def explain(self) -> Explanation:
        """One diagnosis of the rows that are there, behind the last gap."""
        look = self.live.look(len(self.live.ring))
        start = int(look.cuts[-1]) if len(look.cuts) else 0
        counter = look.counter[start:]
        if len(counter) < FEWEST_ROWS:
            return Explanation(
                int(counter[-1]), "waiting", f"{len(counter)} rows since the last gap: {FEWEST_ROWS} needed"
            )
        fields = {name: column[start:] for name, column in look.fields.items()}
        samples = {name: fields[name] for name in fluxproof.Sample._fields}
        with tempfile.TemporaryDirectory(prefix="fluxproof-watch-") as scratch:
            dump = Path(scratch) / "last.fluxdump"
            observed = {name: fields[name] for name in PACKET}
            write_dump(dump, self.drive, self.register_set, samples, observed, counter=counter)
            return self._told(int(counter[-1]), dump)

    def _told(self, counter: int, dump: Path) -> Explanation:
        command = [sys.executable, "-m", "fluxproof", "diagnose", str(dump), "--drive", self.path]
        command += ["--out", str(dump.parent / "out")]
        began = time.monotonic()
        nice = ["nice", "-n", "10"] if os.name == "posix" else []
        try:
            done = subprocess.run([*nice, *command], capture_output=True, text=True, timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            return Explanation(counter, "none", f"no diagnosis within {PATIENCE_S:.0f} s")
        answer = dump.parent / "out" / "diagnosis.json"
        if not answer.exists():
            lines = done.stderr.strip().splitlines() or ["the diagnosis said nothing"]
            return Explanation(counter, "none", lines[-1].replace(str(dump), "the last seconds"))
        data = json.loads(answer.read_text(encoding="utf-8"))
        took = time.monotonic() - began
        return Explanation(counter, data["verdict"], f"{data['sentence']} ({took:.0f} s)", sizes_of(data["effects"]))


def sizes_of(effects: Iterable[dict]) -> dict[str, tuple[float, float, str]]:
    """{"effect: parameter": (value, sigma, unit)} of the effects of a diagnosis.json whose sizes are known."""
    return {
        f"{effect['name']}: {key}": (p["value"], p["sigma"], p["unit"])
        for effect in effects
        for key, p in effect["parameters"].items()
        if p["sigma"] is not None and math.isfinite(p["sigma"])
    }
