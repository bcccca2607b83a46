# SPDX-License-Identifier: BSD-3-Clause
"""Converts a captured telemetry stream to a dump: the words of the core's AXI4-Stream packets as a DMA stores them.

    fluxproof dump capture.bin --drive drive.toml [--registers registers.json] [-o run.fluxdump]

The capture may begin and end inside a packet, contain partial packets (a reset truncates one) and lack packets; the
sample counters show this, also across their overflow at 2**32.  If the counter decreases (a reset, or a ring buffer
read across its end), the capture is split into pieces, and a dump is made of one of them.  A complete packet with
impossible content is damaged, and the capture is rejected.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fluxproof.diagnosis.ground.limits import limited
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.replay.telemetry import MAGIC, write_dump
from golden_model.fluxproof import Sample
from golden_model.io import telemetry_words as packet
from golden_model.io.telemetry_words import COUNT, COUNTER, FIELDS, HEADER_WORD, LAYOUT, PACKET
from golden_model.regular_file import read_regular

MOST_BYTES = 2 << 30  # of a capture, which is read whole
SIZE = 4 * COUNT
MARK = HEADER_WORD.to_bytes(4, "little")
USED = np.zeros(COUNT, np.uint32)  # the bits of each word that belong to fields
for _field in LAYOUT.values():
    USED[_field.word] |= np.uint32(((1 << _field.width) - 1) << _field.lsb)


class Piece(NamedTuple):
    """Consecutive packets with rising counters: byte offset of the first one, and their fields."""

    byte: int
    counter: np.ndarray  # (n,) int64, unwrapped: continues beyond 2**32
    fields: dict[str, np.ndarray]  # {name: (n,) int64}

    def __len__(self) -> int:
        return len(self.counter)

    @property
    def lost(self) -> int:
        """Samples between the first and the last without a packet."""
        return int(self.counter[-1] - self.counter[0]) + 1 - len(self)


class Capture(NamedTuple):
    """The pieces of a file; ``left``: [(byte offset, length)] of bytes outside complete packets."""

    pieces: list[Piece]
    left: list[tuple[int, int]]


def read_capture(path) -> Capture:
    """Read a file of little-endian words; RecordingError if it is unreadable, has no packet or is damaged."""
    try:
        raw = read_regular(path, MOST_BYTES)
        with limited(path):
            return parse(raw, str(path))
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None


def parse(raw: bytes, name: str = "capture") -> Capture:
    """The same for bytes in memory; ``name`` is used in messages."""
    found, bytes_of, left, at = [], [], [], 0
    while (start := _find_start(raw, at)) >= 0:
        rows = _whole_packets(raw, start)
        if start > at:
            left.append((at, start - at))
        places = start + SIZE * np.arange(len(rows))
        _check(rows, places, name)
        found.append(rows)
        bytes_of.append(places)
        at = start + SIZE * len(rows)
    if not found:
        raise RecordingError(f"{name}: {_why_nothing(raw)}")
    if at < len(raw):
        left.append((at, len(raw) - at))
    return Capture(_pieces(np.concatenate(found), np.concatenate(bytes_of)), left)


def _find_start(raw: bytes, at: int) -> int:
    """The first offset from ``at`` with a complete valid packet that is followed by another one; or -1."""
    while (at := raw.find(MARK, at)) >= 0:
        behind = raw[at + SIZE : at + SIZE + len(MARK)]
        if len(raw) - at >= SIZE and MARK.startswith(behind) and sound(_rows(raw, at, 1))[0]:
            return at
        at += 1
    return -1


def _rows(raw: bytes, at: int, count: int) -> np.ndarray:
    return np.frombuffer(raw, "<u4", COUNT * count, at).reshape(count, COUNT)


def _whole_packets(raw: bytes, at: int) -> np.ndarray:
    """Words (n, COUNT) of the consecutive packets from ``at`` on, without a truncated last one."""
    rows = _rows(raw, at, (len(raw) - at) // SIZE)
    others = np.flatnonzero(rows[:, 0] != HEADER_WORD)
    broken = bool(len(others))
    rows = rows[: others[0]] if broken else rows
    last = at + SIZE * (len(rows) - 1)
    if (broken or not sound(rows[-1:])[0]) and raw.find(MARK, last + 1, last + SIZE + len(MARK) - 1) >= 0:
        inside = _find_start(raw, last + 1)
        if 0 <= inside < last + SIZE and len(rows) > 1:  # the next packet begins inside this one
            return rows[:-1]
    return rows


def sound(rows: np.ndarray) -> np.ndarray:
    """(n,) bool: every field is sign- or zero-extended as its format requires, and all other bits are zero."""
    good = np.asarray(~(rows & ~USED).any(axis=1))
    for field in LAYOUT.values():
        value = values(rows, field)
        good &= (value >= field.port.fmt.lo) & (value <= field.port.fmt.hi)
    return good


def values(rows: np.ndarray, field) -> np.ndarray:
    """(n,) int64 of one field."""
    value = (rows[:, field.word].astype(np.int64) >> field.lsb) & ((1 << field.width) - 1)
    return value - ((value >> (field.width - 1)) << field.width) if field.signed else value


def _check(rows: np.ndarray, places: np.ndarray, name: str) -> None:
    """Raise RecordingError for the first invalid packet."""
    wrong = np.flatnonzero(~sound(rows))
    if len(wrong):
        raise RecordingError(f"{name}: {_what_is_wrong(rows[wrong[0]], int(places[wrong[0]]))}")


def _pieces(rows: np.ndarray, places: np.ndarray) -> list[Piece]:
    """Packets split where the counter does not increase."""
    numbers = values(rows, LAYOUT[COUNTER])
    step = (np.diff(numbers) + 2**31) % 2**32 - 2**31
    cuts = [0, *(np.flatnonzero(step <= 0) + 1).tolist(), len(rows)]
    found = []
    for first, stop in zip(cuts, cuts[1:], strict=False):
        counter = numbers[first] + np.concatenate(([0], np.cumsum(step[first : stop - 1])))
        fields = {name: values(rows[first:stop], LAYOUT[name]) for name in FIELDS}
        found.append(Piece(int(places[first]), counter, fields))
    return found


def _what_is_wrong(row: np.ndarray, byte: int) -> str:
    """Description of the first invalid word of a packet."""
    for field_name, field in LAYOUT.items():
        value = int(values(row[None], field)[0])
        if not field.port.fmt.lo <= value <= field.port.fmt.hi:
            shown = f"word {field.word} is 0x{row[field.word]:08x}: {field_name} = {value} is no {field.port.fmt}"
            return f"the packet at byte {byte} is damaged: {shown}"
    word = int(np.flatnonzero(row & ~USED)[0])
    return (
        f"the packet at byte {byte} is damaged: word {word} is 0x{row[word]:08x}, bits beyond 0x{USED[word]:08x} "
        "must be 0"
    )


def _why_nothing(raw: bytes) -> str:
    """The reason why no packet was found."""
    if raw.startswith(MAGIC):
        return "this is a dump already, which `fluxproof diagnose` reads"
    if len(raw) < SIZE:
        return f"{len(raw)} bytes are too few for a telemetry packet, which has {SIZE}"
    for found in re.finditer(rb"(?s)(?=(..)" + packet.MAGIC.to_bytes(2, "little") + b")", raw):
        at, (count, version) = found.start(), found.group(1)
        if count and raw[at + 4 * count : at + 4 * count + 4] == raw[at : at + 4] and raw[at : at + 4] != MARK:
            return (
                f"byte {at}: telemetry packets of version {version} with {count} words: this reader knows version "
                f"{packet.VERSION} with {COUNT}"
            )
    return f"no telemetry packet: no word 0x{HEADER_WORD:08x} starts a valid packet of {SIZE} bytes"


def write_piece(path, piece: Piece, drive, register_set, changes=None) -> Path:
    """Write the dump of one piece; arguments as of telemetry.write_dump."""
    samples = {name: piece.fields[name] for name in Sample._fields}
    observed = {name: piece.fields[name] for name in PACKET}
    return write_dump(path, drive, register_set, samples, observed, counter=piece.counter, changes=changes)
