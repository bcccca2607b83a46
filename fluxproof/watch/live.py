# SPDX-License-Identifier: BSD-3-Clause
"""The last rows of a running drive in bounded memory; one thread reads, everybody else looks.

The reader waits for nobody: it holds the lock while it copies rows in, a look while it copies them out.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from fluxproof.diagnosis.replay.telemetry_stream import values
from fluxproof.watch.packets import Packets
from fluxproof.watch.replay import LiveReplay
from fluxproof.watch.source import Source
from golden_model.io.fault_latch import NAMES
from golden_model.io.telemetry_words import COUNT, COUNTER, FIELDS, LAYOUT

MOST_EVENTS = 50
DRAIN_S = 1.0


class Sink(Protocol):
    """Gets every row."""

    def take(self, counter: np.ndarray, fields: dict[str, np.ndarray]) -> None: ...

    def close(self) -> None: ...


class Look(NamedTuple):
    """Rows at a moment: numbers since the reset, fields as integers; ``cuts``: rows before which some are missing."""

    counter: np.ndarray
    fields: dict[str, np.ndarray]
    cuts: np.ndarray


def fields_of(rows: np.ndarray, names: Sequence[str] = tuple(FIELDS)) -> dict[str, np.ndarray]:
    """{field: (n,) int64} of packets."""
    return {name: values(rows, LAYOUT[name]) for name in names}


def reason_of(first_fault: int) -> str:
    """The faults of the register by name."""
    named = [name for bit, name in enumerate(NAMES) if first_fault >> bit & 1]
    return ", ".join(named) or "no fault, enable fell"


class Live:
    """The reader of a source."""

    def __init__(self, source: Source, capacity: int, replay: LiveReplay, sinks: Sequence[Sink] = ()) -> None:
        self.source, self.packets, self.replay, self.sinks = source, Packets(), replay, tuple(sinks)
        self.lock = threading.Lock()
        self.ring, self.counters = np.zeros((capacity, COUNT), np.uint32), np.zeros(capacity, np.int64)
        self.total = self.lost = self.restarts = 0
        self.events: deque[tuple[int, str]] = deque(maxlen=MOST_EVENTS)  # (number of the sample, what happened)
        self.last: int | None = None  # number of the last sample
        self.last_run = 0
        self.breaks = 0
        self.failure: BaseException | None = None
        self.ending = threading.Event()

    # -------------------------------------------------------------- the reader

    def run(self) -> None:
        """Read until ``ending`` is set; an error ends it and is kept."""
        try:
            while not self.ending.is_set():
                self.pump()
            end = time.monotonic() + DRAIN_S  # what came before the end still counts
            while self.pump() and time.monotonic() < end:
                pass
        except Exception as error:
            self.failure = error
        finally:
            self.source.close()
            for sink in self.sinks:
                sink.close()

    def pump(self) -> int:
        """One read; the rows it brought."""
        data = self.source.read()
        if self.source.breaks != self.breaks:
            self.packets.cut()
            self.breaks = self.source.breaks
        rows = self.packets.feed(data)
        if len(rows):
            self._take(rows)
        while self.packets.notes:
            note = self.packets.notes.pop(0)
            self.events.append((note.counter, f"gates off: {reason_of(note.first_fault)}"))
        return len(rows)

    def _take(self, rows: np.ndarray) -> None:
        numbers = values(rows, LAYOUT[COUNTER])
        before = numbers[0] - 1 if self.last is None else self.last
        step = (np.diff(numbers, prepend=before % 2**32) + 2**31) % 2**32 - 2**31
        fields = fields_of(rows)
        cuts = np.flatnonzero(step != 1).tolist()
        if self.last is None:
            self.replay.cut(bool(numbers[0] == 0))
        starts = sorted({0, *cuts})
        for start, stop in zip(starts, [*starts[1:], len(rows)], strict=True):
            if start in cuts:
                self._cut(int(step[start]), int(numbers[start]))
            part = {name: column[start:stop] for name, column in fields.items()}
            self.replay.take(numbers[start:stop], part)
        self._note_gates(numbers, fields["run"])
        self.last = int(numbers[-1])
        with self.lock:
            keep = rows[-len(self.ring) :]
            at = (self.total + len(rows) - len(keep) + np.arange(len(keep))) % len(self.ring)
            self.ring[at], self.counters[at] = keep, numbers[-len(keep) :]
            self.total += len(rows)
        for sink in self.sinks:
            sink.take(numbers, fields)

    def _cut(self, step: int, number: int) -> None:
        """A gap, or numbers that go back."""
        self.replay.cut(number == 0)
        if step > 1:
            self.lost += step - 1
            self.events.append((number, f"{step - 1} samples are missing"))
        else:
            self.restarts += 1
            self.events.append((number, "the numbers begin anew: the core was reset"))

    def _note_gates(self, numbers: np.ndarray, run: np.ndarray) -> None:
        moved = np.diff(run, prepend=self.last_run)
        for row in np.flatnonzero(moved)[-MOST_EVENTS:]:
            self.events.append((int(numbers[row]), "gates on" if run[row] else "gates off"))
        self.last_run = int(run[-1])

    # -------------------------------------------------------------- who looks

    def look(self, count: int, names: Sequence[str] = tuple(FIELDS)) -> Look:
        """The last ``count`` rows, or as many as there are."""
        with self.lock:
            count = min(count, self.total, len(self.ring))
            at = (self.total - count + np.arange(count)) % len(self.ring)
            rows, counter = self.ring[at], self.counters[at]
        cuts = np.flatnonzero(np.diff(counter) % 2**32 != 1) + 1
        return Look(counter, fields_of(rows, names), cuts)

    def told(self) -> str:
        """Rows, losses and the last event."""
        said = f"{self.total:,} rows, {self.lost:,} lost, {self.packets.skipped:,} bad bytes, {self.breaks} breaks"
        return said if not self.events else f"{said}; sample {self.events[-1][0]}: {self.events[-1][1]}"
