# SPDX-License-Identifier: BSD-3-Clause
"""Whole, sound packets out of a stream of bytes that comes in pieces, and the host's notes between them; bad bytes cost
the packets they hit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fluxproof.diagnosis.replay.telemetry_stream import MARK, SIZE, sound
from golden_model.io.telemetry_words import COUNT, HEADER_WORD, NOTE_FAULT, NOTE_WORD

NOTE_MARK = NOTE_WORD.to_bytes(4, "little")


class Note(NamedTuple):
    """Why the gates went off: the number of the sample, and the register first_fault."""

    counter: int
    first_fault: int


class Packets:
    """Keeps what has come of the next packet: less than one packet between two calls."""

    def __init__(self) -> None:
        self.rest = b""
        self.skipped = 0  # bytes that belong to no sound packet
        self.notes: list[Note] = []  # that came, for who takes them out

    def cut(self) -> None:
        """The stream begins anew: what has come of a packet is lost."""
        self.skipped += len(self.rest)
        self.rest = b""

    def feed(self, data: bytes) -> np.ndarray:
        """(n, COUNT) uint32, the packets that are complete now."""
        raw, at, found = self.rest + data, 0, []
        while True:
            start, note = raw.find(MARK, at), raw.find(NOTE_MARK, at)
            if note >= 0 and (start < 0 or note < start):
                self.skipped += note - at
                at = note
                if len(raw) - at < SIZE:
                    break
                words = np.frombuffer(raw, "<u4", COUNT, at)
                self.notes.append(Note(int(words[1]), int(words[NOTE_FAULT])))
                at += SIZE
                continue
            if start < 0:
                kept = max(at, len(raw) - len(MARK) + 1)
                self.skipped += kept - at
                at = kept
                break
            self.skipped += start - at
            count = (len(raw) - start) // SIZE
            rows = np.frombuffer(raw, "<u4", COUNT * count, start).reshape(count, COUNT)
            wrong = np.flatnonzero((rows[:, 0] != HEADER_WORD) | ~sound(rows))
            good = int(wrong[0]) if len(wrong) else count
            found.append(rows[:good])
            at = start + SIZE * good
            if good == count:
                break
            if raw.startswith(NOTE_MARK, at):
                continue
            self.skipped += 1  # the mark of the bad packet; the next one may begin inside it
            at += 1
        self.rest = raw[at:]
        return np.concatenate(found) if found else np.zeros((0, COUNT), np.uint32)
