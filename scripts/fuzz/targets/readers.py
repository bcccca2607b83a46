# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of every format: read whole, and with the columns of a drive."""

from __future__ import annotations

import contextlib

import h5py
import numpy as np
from hypothesis import strategies as st

from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.readers import read_table
from scripts.fuzz import corpus
from scripts.fuzz.drawn import damage, hdf5, mdf, tables, text

SECONDS, TURN, NAMES_FILE = 5.0, 60, True
CANARY = 271828.25  # what a foreign file holds; no case may show it
kept: list = []


def cases():
    files = corpus.recordings()
    texts = tuple(case for case in files if case.suffix in (".csv", ".txt"))
    damaged = damage.damaged(files)
    return st.one_of(damaged, damaged, text.damaged_table(texts), hdf5.hostile(), mdf.hostile(), tables.hostile())


def run(path) -> None:
    """The file as a table, then as a recording; an error of the one does not spare the other."""
    _foreign(path.parent)
    failure = None
    try:
        table = read_table(path)
        lengths = {len(values) for values in table.columns.values()}
        assert len(lengths) == 1, f"columns of lengths {lengths}"
        assert not any((values == CANARY).any() for values in table.columns.values()), "shows a foreign file"
    except RecordingError as error:
        failure = error
    recording = load_recording(path, kept[0])
    n = len(recording)
    assert all(len(v) == n for v in (*recording.columns.values(), recording.usable, recording.joined)), "ragged"
    if not recording.fatal:
        assert all(np.isfinite(v).all() for v in recording.columns.values()), "not finite"
    assert all(p.message.isprintable() for p in recording.problems), "a finding that is not printable"
    if failure is not None:
        raise failure


def _foreign(folder) -> None:
    """A file beside the case that links may name."""
    np.full(64, CANARY).tofile(folder / "canary.bin")
    (folder / "canary.h5").write_bytes(kept[1])


def warm(folder) -> None:
    """Every reader once, so that each library is loaded."""
    path = folder / "drive.toml"
    path.write_text(corpus.NOMINAL)
    with h5py.File(folder / "foreign.h5", "w") as file:
        file["canary"] = np.full(64, CANARY)
    kept[:] = [load_nominal(path), (folder / "foreign.h5").read_bytes()]
    for number, (suffix, content) in enumerate(corpus.recordings()):
        path = folder / f"valid{number}{suffix}"
        path.write_bytes(content)
        with contextlib.suppress(RecordingError):
            run(path)
