# SPDX-License-Identifier: BSD-3-Clause
"""Drive files with keys at the ends of their ranges, and everything that a command derives from one before it runs."""

from __future__ import annotations

import dataclasses
import math
import random
import warnings
from pathlib import Path

import tomlkit

from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.plant_section import errors_beyond, plant_of
from fluxproof.diagnosis.improve.improved_core import core_values
from fluxproof.print_registers import bases_lines, c_lines, table
from fluxproof.project import parts, render
from fluxproof.simulate import verdict
from fluxproof.simulate.margins import current_loop, margins, speed_loop
from fluxproof.simulate.scene import current_step, main_scene
from golden_model.board_registers import board_set
from golden_model.drive import SECTIONS, load
from golden_model.drive_file import read_tables
from golden_model.drive_keys import DriveError, key_of

KEYS = [(section, f.name, key_of(f)) for section, kind in SECTIONS.items() for f in dataclasses.fields(kind)]
BEYOND = (0.0, -1.0, 5e-324, 1e-300, 1e300, 1.7e308, math.nan, math.inf, -math.inf)
PART = "xc7z020clg484-1"


def ends(key) -> list:
    """The ends of a key's range, and both steps beyond where those are numbers."""
    if key.kind == "bool":
        return [True, False]
    if key.kind == "word":
        return list(key.words)
    return [key.lo, key.hi]


def drawn(key, rng: random.Random):
    """A value of the key: an end, or one between them at random in the logarithm."""
    if key.kind != "float" or rng.random() < 0.4:
        value = rng.choice(ends(key))
    else:
        least = key.lo if key.lo > 0.0 else 1e-15 * key.hi
        value = math.exp(rng.uniform(math.log(least), math.log(key.hi)))
        value = -value if key.lo < 0.0 and rng.random() < 0.5 and -value >= key.lo else value
    return [value] * key.count if key.count else value


def beyond(key, rng: random.Random):
    """A number that no machine has."""
    value = rng.choice(BEYOND)
    return [value] * key.count if key.count else value


def written(path: Path, tables: dict, changes) -> Path:
    """The drive file of ``tables`` with ``changes`` ((section, key, value), ...)."""
    tables = {name: dict(table) for name, table in tables.items()}
    for section, name, value in changes:
        tables.setdefault(section, {})[name] = value
    path.write_text(tomlkit.dumps(tables), encoding="utf-8")
    return path


def changed_drives(paths, count: int, seed: int, values=drawn, most: int = 2):
    """``count`` lists of changes with the tables of the file they are for: one to ``most`` keys each."""
    rng, files = random.Random(seed), [read_tables(path) for path in paths]
    for _ in range(count):
        keys = rng.sample(KEYS, rng.randint(1, most))
        yield rng.choice(files), [(section, name, values(key, rng)) for section, name, key in keys]


def derived(path: Path, scene: bool = True) -> list[str]:
    """Everything that the commands derive from a drive file; the lines of the DriveErrors, all else is raised.

    scene: with the scenario of ``simulate``, which takes half a second.
    """
    refused = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for part in (_of_the_core, _of_the_loops, *([_of_the_scene] if scene else []), _of_the_diagnosis):
            try:
                part(path)
            except DriveError as error:
                refused.append(str(error))
    return refused


def _of_the_core(path) -> None:
    drive = load(path)
    register_set = board_set(drive)
    assert bases_lines(drive, register_set) and table(register_set.rows) and c_lines(str(path), drive, register_set)
    project = render.Project(str(path), drive, register_set, PART, parts.ZYNQ.base, "", False)
    assert render.files(project, parts.ZYNQ)


def _of_the_scene(path) -> None:
    drive = load(path)
    assert len(main_scene(drive).scenario) and len(current_step(drive).scenario)


def _of_the_loops(path) -> None:
    drive = load(path)
    register_set = board_set(drive)
    for loop in (current_loop(drive, register_set, "d"), speed_loop(drive, register_set)):
        assert loop is None or margins(loop).to_json()
    assert verdict.modelled(drive, []) and verdict.not_modelled(drive, [])


def _of_the_diagnosis(path) -> None:
    nominal = load_nominal(path)
    plant = plant_of(nominal)
    assert all(math.isfinite(value) for value in errors_beyond(plant.sensors, nominal)["current_gain"])
    assert core_values(nominal, []) == []
