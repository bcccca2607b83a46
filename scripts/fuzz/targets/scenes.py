# SPDX-License-Identifier: BSD-3-Clause
"""Drive files, as `simulate` reads them: its scene and its margins, without the simulation itself."""

from __future__ import annotations

import contextlib

from fluxproof.simulate.margins import current_loop, margins, speed_loop
from fluxproof.simulate.scene import current_step, main_scene
from golden_model.board_registers import board_set
from golden_model.drive import load
from golden_model.drive_keys import DriveError
from scripts.fuzz import corpus
from scripts.fuzz.drawn import toml
from scripts.fuzz.targets.drives import named

SECONDS, TURN, NAMES_FILE = 20.0, 20, True


def cases():
    return toml.drive(corpus.drives()[1:])


def run(path) -> None:
    drive = load(path)
    with named(path):
        result = board_set(drive)
        main_scene(drive)
        current_step(drive)
        for loop in (*(current_loop(drive, result, axis) for axis in "dq"), speed_loop(drive, result)):
            if loop is not None:
                margins(loop)


def warm(folder) -> None:
    path = folder / "valid.toml"
    path.write_bytes(corpus.drives()[1])
    with contextlib.suppress(DriveError):
        run(path)
