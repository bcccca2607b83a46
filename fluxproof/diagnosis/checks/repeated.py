# SPDX-License-Identifier: BSD-3-Clause
"""Samples that were dropped or written twice although the time advances evenly, found from the angle.

The angle advances evenly.  A row in which it advances twice as far as before and after, or not at all with all
channels unchanged, is a fault of the logger, and the rows are not joined there.  A recording that changes only every
few rows was sampled more slowly than its time says.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import wrapped
from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
CLEAR = 10.0  # times the usual scatter of the angle steps
RARE = 0.05
CHANCE = 20.0
INDEPENDENT = ("i_a", "i_b", "i_d", "i_q", "theta_e", "u_dc")
HELD = 0.4
CODES = 1.5  # smallest steps of the angle up to which an encoder's next code doubles the advance
LEAST_ADVANCE = 1e-3  # rad per row; a smaller advance is not significant


def check(recording, nominal) -> None:
    if recording.slow or not recording.has("theta_e", "omega_e"):
        return
    advance = wrapped(np.diff(recording["theta_e"]))
    joined = recording.joined[:-1] & recording.usable[:-1] & recording.usable[1:]
    if _held(recording, advance, joined, nominal.sample_time_s):
        return
    # The advance expected from the neighbouring steps; a recorded speed is filtered and lags.
    expected = np.zeros_like(advance)
    expected[1:-1] = 0.5 * (advance[:-2] + advance[2:])
    even = np.zeros(len(advance), bool)
    even[1:-1] = np.abs(advance[2:] - advance[:-2]) < 0.3 * np.abs(expected[1:-1])
    scatter = 1.5 * float(np.median(np.abs(advance - expected)[joined])) if joined.any() else 0.0
    clear = joined & even & (np.abs(expected) > max(CLEAR * scatter, 1e-4)) & (np.abs(expected) < 1.0)
    turns = advance / np.where(expected == 0.0, 1.0, expected) - 1.0
    where = np.flatnonzero(clear & (turns > 0.7) & (np.abs(turns - np.round(turns)) < 0.3))
    if len(where) and len(where) <= RARE * np.count_nonzero(clear):
        recording.joined[where] = False
        lost = counted(int(np.sum(np.round(turns[where]))), "sample")
        message = f"the angle jumps ahead in {counted(len(where), 'row')}, about {lost} missing"
        turning = np.abs(advance[joined & (advance != 0.0)])
        if np.median(np.abs(expected[where])) < CODES * np.min(turning):
            message += ", or the steps of a coarse encoder"
        recording.problems.append(
            Problem("dropped", message, "theta_e", int(where[0]) + 1, len(where), "no balance is made across them")
        )  # fmt: skip


def _held(recording, advance, joined, period) -> bool:
    """Handle rows that repeat the previous one; True if most do, that is, the recording is a slow one."""
    turning = joined & (np.abs(recording["omega_e"][1:]) * period > LEAST_ADVANCE)
    still = np.flatnonzero(turning & (advance == 0.0))
    still = still[_same(recording, still)]
    if not len(still):
        return False
    row, count = int(still[0]) + 1, len(still)
    if count <= CHANCE * _by_chance(recording):
        return False
    slow = bool(count > HELD * np.count_nonzero(turning))
    if slow:
        recording.slow = True
        message = f"{count} rows repeat the previous one: sampled more slowly than the time column states"
        action = "only steady operating points are used"
    else:
        recording.usable[still + 1] = False
        recording.joined[still] = False
        message, action = f"{count} rows repeat the previous one", "not used"
    recording.problems.append(Problem("repeated", message, "", row, count, action))
    return slow


def _by_chance(recording) -> float:
    """Expected number of rows that equal the previous one by chance, if the channels repeat codes independently.

    The other channels follow from these: equal samples give equal duties.
    """
    share = 1.0
    for name in INDEPENDENT:
        if name in recording.columns:
            values = recording[name]
            share *= np.count_nonzero(values[1:] == values[:-1]) / len(values)
    return share * len(recording)


def _same(recording, rows) -> np.ndarray:
    """(len(rows),) bool: whether row k+1 equals row k in every channel, for k in ``rows``."""
    same = np.ones(len(rows), bool)
    for name, values in recording.columns.items():
        if name != "t":
            same &= values[rows] == values[rows + 1]
    return same
