# SPDX-License-Identifier: BSD-3-Clause
"""The drives whose recordings are written: those of docs/drives that have a rated speed, and their deviations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import tomlkit

from fluxproof.files import write_text
from golden_model.drive_file import read_tables
from studies.scored.truth import Case, Cause, Truth

FOLDER = Path(__file__).parents[2] / "docs" / "drives"
ROOM = 0.02  # of a value: interval of its size
NAMES = {"resistance_ohm": "resistance", "magnet_flux_wb": "magnet_flux"}


@dataclass(frozen=True)
class Made:
    """columns of a recording (n,), or text of its file; the drive file; the truth."""

    columns: dict | str
    drive: dict
    truth: Truth
    suffix: str = ".csv"

    def written(self, folder: Path) -> tuple[list[Path], Path]:
        """(recordings, drive file) in a folder."""
        drive = write_text(folder / "drive.toml", tomlkit.dumps(self.drive))
        text = self.columns
        if isinstance(text, dict):
            text = pd.DataFrame(text).to_csv(index=False, float_format="%.7g", lineterminator="\n")
        return [write_text(folder / f"recording{self.suffix}", text)], drive


def drive_of(name: str) -> dict:
    """The tables of a drive file of docs/drives."""
    return {section: dict(values) for section, values in read_tables(FOLDER / f"{name}.toml").items()}


def true_machine(drive: dict, **factors) -> tuple[dict, list[Cause]]:
    """([machine] of the motor, the causes) for factors on constants of the drive file."""
    machine, causes = dict(drive["machine"]), []
    for key, factor in factors.items():
        machine[key] *= factor
        low, high = sorted(((1 - ROOM) * machine[key], (1 + ROOM) * machine[key]))
        causes.append(Cause((NAMES[key],), {key: (low, high)}))
    return machine, causes


def case(kind: str, name: str, make: Callable[[np.random.Generator], Made]) -> Case:
    """A case whose random numbers are those of its name."""
    made = make(np.random.default_rng(list(f"{kind} {name}".encode())))
    return Case(f"{kind}.{name}", made.truth, made.written)
