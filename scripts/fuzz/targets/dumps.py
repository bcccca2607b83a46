# SPDX-License-Identifier: BSD-3-Clause
"""Telemetry: dumps, captures of the stream, register files; a dump is replayed in the golden model too."""

from __future__ import annotations

import contextlib
import json
import struct

import numpy as np
from hypothesis import strategies as st

from fluxproof.checkout import DRIVES
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.replay import telemetry
from fluxproof.diagnosis.replay.digital import replay
from fluxproof.diagnosis.replay.telemetry_stream import read_capture, write_piece
from fluxproof.dump_capture import chosen, summary, with_registers
from golden_model.board_registers import board_set
from golden_model.drive import load
from scripts.fuzz import corpus
from scripts.fuzz.case import Case
from scripts.fuzz.drawn.damage import damaged
from scripts.fuzz.drawn.text import encoded, names

SECONDS, TURN, NAMES_FILE = 15.0, 40, True
kept: dict = {}
INTEGERS = st.one_of(
    st.sampled_from((0, 1, -1, 2**31, 2**31 - 1, -(2**31), 2**62, 2**63, 10**400)), st.integers(-100, 100)
)
JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), INTEGERS, INTEGERS, st.floats(), names),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(names, inner, max_size=3)),
    max_leaves=5,
)


def cases():
    files = corpus.telemetry()
    dump, capture, registers = files
    return st.one_of(damaged(files), headers(dump), packets(capture), register_files(registers))


@st.composite
def headers(draw, dump: Case) -> Case:
    """A dump with another header, whose checksums are right as far as they can be made so."""
    (length,) = struct.unpack_from("<I", dump.content, 8)
    header, rows = json.loads(dump.content[12 : 12 + length]), dump.content[12 + length :]
    for _ in range(draw(st.integers(1, 3))):
        table = header
        while True:
            key = draw(st.sampled_from(sorted(table) if isinstance(table, dict) else range(len(table))))
            if not isinstance(table[key], (dict, list)) or not table[key] or draw(st.booleans()):
                break
            table = table[key]
        kind = draw(st.sampled_from(("value", "value", "number", "out", "again")))
        if kind == "out":
            del table[key]
        elif kind == "again" and isinstance(table, list):
            table.append(table[key])
        elif kind == "number":
            table[key] = draw(INTEGERS)
        else:
            table[key] = draw(JSON)
        if not header:
            break
    with contextlib.suppress(Exception):  # a header without what the checksum covers keeps its own
        header["checksum"] = header["checksum"] and telemetry._checksums(header)
    text = json.dumps(header).encode("utf-8", "surrogatepass")
    return Case(".dump", b"FLUXDUMP" + struct.pack("<I", len(text)) + text + rows)


@st.composite
def packets(draw, capture: Case) -> Case:
    """A capture with other counters, lost, repeated and cut packets."""
    size = len(capture.content) // 40
    parts = [capture.content[k * size : (k + 1) * size] for k in range(40)]
    for _ in range(draw(st.integers(0, 5))):
        at = draw(st.integers(0, len(parts) - 1))
        kind = draw(st.sampled_from(("out", "again", "cut", "word", "junk")))
        if kind == "out" and len(parts) > 1:
            del parts[at]
        elif kind == "again":
            parts.insert(at, parts[draw(st.integers(0, len(parts) - 1))])
        elif kind == "cut":
            parts[at] = parts[at][: draw(st.integers(0, size))]
        elif kind == "word" and len(parts[at]) == size:
            word = draw(st.integers(1, size // 4 - 1))
            value = struct.pack("<I", draw(st.integers(0, 2**32 - 1)))
            parts[at] = parts[at][: 4 * word] + value + parts[at][4 * word + 4 :]
        else:
            parts.insert(at, draw(st.binary(max_size=12)))
    return Case(".bin", b"".join(parts))


@st.composite
def register_files(draw, registers: Case) -> Case:
    """JSON of registers with other names and values, in both of its forms."""
    values = json.loads(registers.content)
    for _ in range(draw(st.integers(0, 4))):
        key = draw(st.one_of(st.sampled_from(sorted(values)), names))
        values[key] = draw(st.one_of(JSON, st.fixed_dictionaries({"integer": JSON})))
    whole = {"registers": values, "generics": draw(st.one_of(JSON, st.dictionaries(names, JSON, max_size=3)))}
    data = draw(st.one_of(st.just(values), st.just(whole), JSON))
    text = draw(st.one_of(st.just(json.dumps(data)), st.just("[" * 100_000), st.just("1" * 5000), names))
    return Case(".json", draw(encoded(text)))


def run(path) -> None:
    {".bin": _capture, ".json": _registers}.get(path.suffix, _dump)(path)


def _dump(path) -> None:
    """The dump as `diagnose` reads it, and its replay."""
    columns, meta = telemetry.read_dump(path)
    assert {len(v) for v in columns.values()} == {len(meta["samples"])}, "ragged"
    recording = load_recording(path, kept["nominal"])
    digital, notes = replay(recording)
    json.dumps(vars(digital), default=str)
    assert all(note.isprintable() for note in notes), "a note that is not printable"


def _capture(path) -> None:
    """As `dump` does; what it writes can be read again."""
    capture = read_capture(path)
    number = chosen(capture.pieces, None, path)
    out = write_piece(path.with_suffix(".fluxdump"), capture.pieces[number], kept["drive"], kept["registers"])
    assert all(line.isprintable() for line in summary(capture, number))
    _, meta = telemetry.read_dump(out)
    assert np.array_equal(meta["counter"] % 2**32, capture.pieces[number].counter % 2**32), "other counters"


def _registers(path) -> None:
    found = with_registers(kept["registers"], path)
    assert all(type(v) is int for v in found.values), "a register that is no integer"


def warm(folder) -> None:
    path = DRIVES / "paper000.toml"
    drive = load(path)
    kept.update(nominal=load_nominal(path), drive=drive, registers=board_set(drive))
    for number, (suffix, content) in enumerate(corpus.telemetry()):
        path = folder / f"valid{number}{suffix}"
        path.write_bytes(content)
        with contextlib.suppress(RecordingError):
            run(path)
