# SPDX-License-Identifier: BSD-3-Clause
"""Drive files, as `registers` and `diagnose` read them."""

from __future__ import annotations

import contextlib
import json

from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.plant_section import plant_of
from fluxproof.print_registers import as_json, bases_lines, c_lines, load_list, table
from golden_model.board_registers import board_set
from golden_model.drive import load
from golden_model.drive_keys import DriveError
from scripts.fuzz import corpus
from scripts.fuzz.drawn import toml

SECONDS, TURN, NAMES_FILE = 5.0, 100, True


def cases():
    return toml.drive(corpus.drives())


def run(path) -> None:
    """Each reading by itself: what one refuses another may take."""
    failures = []
    for reading in (_registers, _nominal):
        try:
            reading(path)
        except DriveError as error:
            failures.append(error)
    if failures:
        raise failures[0]


def _registers(path) -> None:
    """What `registers` prints in its three formats and writes as JSON."""
    drive = load(path)
    with named(path):
        result = board_set(drive)
    assert all(row.low <= row.integer <= row.high for row in result.rows), "a register out of its range"
    lines = [*bases_lines(drive, result), *table(result.rows), *c_lines(str(path), drive, result)]
    assert all(line.isprintable() for line in lines), "a line that is not printable"
    json.dumps(as_json(drive, result), allow_nan=False)
    json.dumps(load_list(result), allow_nan=False)


def _nominal(path) -> None:
    nominal = load_nominal(path)
    assert nominal.sample_time_s > 0.0
    plant_of(nominal)


@contextlib.contextmanager
def named(path):
    """The command puts the file's name before such a message."""
    try:
        yield
    except DriveError as error:
        raise DriveError(f"{path}: {error}") from None


def warm(folder) -> None:
    for number, content in enumerate(corpus.drives()[1:3]):
        path = folder / f"valid{number}.toml"
        path.write_bytes(content)
        with contextlib.suppress(DriveError):
            run(path)
