# SPDX-License-Identifier: BSD-3-Clause
"""The same recordings as another bench would have cut and written them: the truth stays, so the answer has to.

A variant changes what no cause depends on: which rows were kept, how many digits, the order and names of the columns,
noise of the size that a log has, a constant of the drive file that is found again at its true size.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from fluxproof.files import write_text
from studies.real.files import written
from studies.real.truth import CASES
from studies.scored.truth import Case

NOISE = 2e-3  # rms, relative to the largest value of a column
KEPT = 0.6  # of the rows: the first or the last of them
CUT = ("locked_table", "locked_log", "moteus_mj5208", "moteus_spindle", "moteus_flipsky6374", "pmsyr_slow",
       "metu_columns_and_step", "vesc_light", "slow_t", "one_point_angle", "warm_two_points", "emf_line_100rpm",
       "rpm_no_angle")  # fmt: skip
SIZED = ("locked_table", "locked_log", "moteus_mj5208", "moteus_spindle", "moteus_flipsky6374")  # at rest, or of sizes
WHOLE = ("warm_two_points",)  # what drifts is counted from the first row: a part has another truth
KEYS = ("resistance_ohm", "inductance_d_h", "inductance_q_h", "magnet_flux_wb")


def every_other(table, rng):
    return table.iloc[::2]


def first_part(table, rng):
    return table.iloc[: round(KEPT * len(table))]


def last_part(table, rng):
    return table.iloc[-round(KEPT * len(table)) :]


def four_digits(table, rng):
    """As a logger writes floats; the time keeps its digits."""

    def column(values):
        return values if _is_time(values.name) or values.dtype.kind != "f" else values.map(lambda x: float(f"{x:.4g}"))

    return table.apply(column)


def noisy(table, rng):
    def column(values):
        still = values.nunique() == 1 or _is_time(values.name) or values.dtype.kind not in "fi"
        return values if still else values + NOISE * values.abs().max() * rng.standard_normal(len(values))

    return table.apply(column)


def other_order(table, rng):
    """Columns from the last to the first."""
    return table[table.columns[::-1]]


TABLE_VARIANTS = (every_other, first_part, last_part, four_digits, noisy, other_order)


def _is_time(name: str) -> bool:
    return re.match(r"(t|time|timestamp|ms)(?![a-z])", name, re.IGNORECASE) is not None


def _varied(case: Case, change: Callable) -> Case:
    """A case with its recording changed."""

    def files(folder: Path):
        (source,), drive = case.files(folder)
        separator = ";" if ";" in source.open().readline() else ","
        table = pd.read_csv(source, sep=separator)
        rng = np.random.default_rng(zlib.crc32(f"{case.name} {change.__name__}".encode()))
        return [written(change(table, rng), folder / f"{change.__name__}.csv", separator)], drive

    return Case(f"{case.name}+{change.__name__}", case.truth, files)


def _nameplate(case: Case, key: str, factor: float) -> Case:
    """A case whose drive file has another value of a constant of the machine."""

    def files(folder: Path):
        sources, drive = case.files(folder)
        text, count = re.subn(
            rf"^({key}\s*=\s*)([0-9.eE+-]+)",
            lambda m: f"{m[1]}{float(m[2]) * factor:.6g}",
            drive.read_text(),
            flags=re.M,
        )
        if count != 1:
            raise ValueError(f"{drive}: {key} stands {count} times")
        return sources, write_text(folder / "drive_varied.toml", text)

    return Case(f"{case.name}+{key}_times_{factor:g}", case.truth, files)


def varied() -> list[Case]:
    """All variants of all cases that have them."""
    cases = {case.name: case for case in CASES}
    parts = (first_part, last_part)
    made = [_varied(cases[n], c) for n in CUT for c in TABLE_VARIANTS if not (n in WHOLE and c in parts)]
    return made + [_nameplate(cases[n], key, f) for n in SIZED for key in KEYS for f in (0.7, 1.5)]
