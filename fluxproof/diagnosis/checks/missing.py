# SPDX-License-Identifier: BSD-3-Clause
"""Missing, infinite and absurd numbers: interpolated, and their rows excluded from every balance.

Slow channels of a log merged from several rates are mostly empty; their last value is held.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "values"
ABSURD = 1e9  # larger values are due to an overflow or a wrong format
SLOW = ("temp_winding", "torque", "u_dc", "i_d_ref", "i_q_ref", "u_d_ref", "u_q_ref", "fault", "enable")
OPTIONAL = ("temp_winding", "torque", "i_d_ref", "i_q_ref", "fault", "enable")
PHASES = ("i_a", "i_b", "i_c")
MOST_MISSING = 0.5  # largest missing share of a required column


def check(recording, nominal) -> None:
    _drop_rows_without_time(recording)
    columns, n = recording.columns, len(recording)
    for name in [c for c in columns if c != "t"]:
        good = np.isfinite(columns[name])
        good &= np.abs(columns[name]) < ABSURD
        bad = n - int(np.count_nonzero(good))
        if not bad:
            continue
        row = int(np.argmin(good))
        if bad == n:
            if name in OPTIONAL:
                recording.meta["notes"].append(f"{name} contains no number and is ignored")
                del columns[name]
            elif name in PHASES and recording.has(*PHASES):
                del columns[name]
                action = "computed from the other two"
                recording.problems.append(Problem("missing", "contains no finite number", name, row, bad, action))
            else:
                recording.problems.append(Problem("missing", "contains no finite number", name, row, bad, fatal=True))
            continue
        if name not in SLOW and bad > MOST_MISSING * n:
            message = f"{bad} of {n} values are missing or not finite"
            recording.problems.append(Problem("missing", message, name, row, bad, fatal=True))
            continue
        where = np.flatnonzero(good)
        filled = columns[name].copy()
        if name in SLOW and bad > 0.1 * n:
            filled = filled[where[np.maximum(np.searchsorted(where, np.arange(n), side="right") - 1, 0)]]
            recording.meta["notes"].append(f"{name} has a value in {n - bad} of {n} rows; the last value is held")
        else:
            lost = np.flatnonzero(~good)
            filled[lost] = _between(name, lost, where, columns[name][where])
            recording.usable[lost] = False
            recording.problems.append(
                Problem(
                    "missing",
                    f"{name}: {counted(bad, 'value')} missing or not finite, {_place(recording, row)}",
                    name,
                    row,
                    bad,
                    "interpolated; rows not used",
                )
            )
        columns[name] = filled


def _place(recording, row: int) -> str:
    """Where a row stands in its file, as far as that has lines."""
    lines = recording.meta.get("lines")
    return f"the first in row {row}" if lines is None else f"the first in line {lines[row]}"


def _between(name, lost, where, values):
    """Values for missing rows; a wrapped angle is held, since interpolating across its wrap would be wrong."""
    if name == "theta_e":
        return values[np.maximum(np.searchsorted(where, lost) - 1, 0)]
    return np.interp(lost, where, values)


def _drop_rows_without_time(recording) -> None:
    t = recording.columns["t"]
    good = np.isfinite(t) & (np.abs(t) < 1e20)
    bad = len(t) - int(np.count_nonzero(good))
    if not bad:
        return
    row = int(np.argmin(good))
    if bad > MOST_MISSING * len(t) or len(t) - bad < 2:
        message = f"{bad} of {len(t)} times are missing or not finite"
        recording.problems.append(Problem("missing", message, "t", row, bad, fatal=True))
        return
    recording.problems.append(Problem("missing", f"{bad} rows without a time", "t", row, bad, "left out"))
    keep_rows(recording, np.flatnonzero(good))


def keep_rows(recording, rows) -> None:
    """Keep these rows (indices, in this order) of every array; rows that were not consecutive are not joined."""
    joined = recording.joined[rows]
    joined[:-1] &= np.diff(rows) == 1
    if len(joined):
        joined[-1] = False
    recording.columns = {name: values[rows] for name, values in recording.columns.items()}
    recording.usable, recording.joined = recording.usable[rows], joined
    if "run" in recording.meta:
        recording.meta["run"] = recording.meta["run"][rows]
    if "lines" in recording.meta:
        recording.meta["lines"] = recording.meta["lines"][rows]
