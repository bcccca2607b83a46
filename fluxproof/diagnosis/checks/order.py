# SPDX-License-Identifier: BSD-3-Clause
"""Time that runs backwards and duplicate rows: sorted, appended as a new run, or removed."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.missing import keep_rows
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "time"
RESTART_STEPS = 100  # a longer step back is a restart of the clock, a shorter one a misplaced row


def check(recording, nominal) -> None:
    t = recording["t"]
    if recording.points:  # without a time
        return
    if len(t) < 2:
        recording.problems.append(Problem("too_short", f"{len(t)} row: several are needed", "t", 0, len(t), fatal=True))
        return
    step = np.diff(t)
    forward = step[step > 0]
    if not len(forward):
        message = "time does not advance" if not np.any(step < 0) else "time runs backwards throughout"
        recording.problems.append(Problem("time_order", message, "t", 0, len(t), fatal=True))
        return
    usual = float(np.median(forward))
    back = np.flatnonzero(step < 0)
    if len(back):
        _mend(recording, step, back, usual)
    _duplicates(recording)


def _mend(recording, step, back, usual) -> None:
    """Shift the time after a restart of the clock; sort misplaced rows."""
    restarts = back[step[back] < -RESTART_STEPS * usual]
    shuffled = len(back) > max(20, len(step) // 1000)
    if len(restarts) and not shuffled:
        t = recording["t"].copy()
        for k in restarts:
            t[k + 1 :] += t[k] - t[k + 1] + RESTART_STEPS * usual
        recording.columns["t"] = t
        part = np.zeros(len(t), int)
        part[restarts + 1] = 1
        recording.meta["run"] = recording.meta.get("run", 0) + np.cumsum(part)
        recording.problems.append(
            Problem("time_order", f"time restarts {len(restarts)} times", "t", int(restarts[0]) + 1, len(restarts),
                    "each part is treated as a separate run")
        )  # fmt: skip
        back = np.flatnonzero(np.diff(t) < 0)
    if len(back):
        rows = np.argsort(recording["t"], kind="stable")
        keep_rows(recording, rows)
        if shuffled:  # of a few rows the time may be wrong and not the place; of all, hardly two were neighbours
            recording.joined[:-1] = True  # as far as their steps are those of the control (sampling.py)
        recording.problems.append(
            Problem(
                "time_order",
                f"time runs backwards {len(back)} times",
                "t",
                int(back[0]) + 1,
                len(back),
                "rows sorted",
            )
        )


def _duplicates(recording) -> None:
    """Remove rows that equal the previous one in every column including time."""
    same = np.flatnonzero(np.diff(recording["t"]) == 0)
    if not len(same):
        return
    twice = same[_equal_rows(recording, same)]
    if len(twice):
        keep = np.ones(len(recording), bool)
        keep[twice + 1] = False
        keep_rows(recording, np.flatnonzero(keep))
        recording.joined[:-1] |= np.diff(recording["t"]) > 0
        recording.problems.append(
            Problem(
                "duplicate",
                f"{len(twice)} duplicate rows",
                "t",
                int(twice[0]) + 1,
                len(twice),
                "one copy removed",
            )
        )


def _equal_rows(recording, rows) -> np.ndarray:
    """(len(rows),) bool: whether row k+1 equals row k in every column except time, for k in ``rows``."""
    equal = np.ones(len(rows), bool)
    for name, values in recording.columns.items():
        if name != "t":
            equal &= values[rows] == values[rows + 1]
    return equal
