# SPDX-License-Identifier: BSD-3-Clause
"""Several rows in each period of the PWM, as a fast logger or a simulation writes: one of each period is kept.

Kept is the row with which a new command begins: the carrier is at its valley or peak there, and the ripple of the
current crosses zero.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.missing import keep_rows
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "time"
AFTER = ("order",)
EVEN = 0.02  # how near the period is to a whole number of rows
MOST = 256  # rows of a period
LEAST = 50  # periods
RHYTHM = 0.9  # share of the changes of a command that are at one place in the period
CLOSE = 0.05  # of the advance of the angle
COMMANDS = ("d_a", "d_b", "d_c", "u_d_ref", "u_q_ref")


def check(recording, nominal) -> None:
    if recording.points or recording.fatal or len(recording) < 2 * LEAST:
        return
    step = np.diff(recording["t"])
    if not (step > 0.0).any():
        return
    usual = float(np.median(step[step > 0.0]))
    times = round(nominal.sample_time_s / usual)
    if not 2 <= times <= MOST or abs(nominal.sample_time_s / usual / times - 1.0) > EVEN:
        return
    ratio = angle_speed_ratio(recording, usual)
    if ratio is not None and abs(ratio - 1.0) > CLOSE:  # the time is wrong, not the number of rows
        return
    first = _beginning(recording, times)
    if first is None or len(recording) // times < LEAST:
        return
    rows = len(recording)
    gaps = step > 1.5 * usual
    keep_rows(recording, np.arange(first, rows, times))
    recording.joined[:-1] = True
    for lost in np.flatnonzero(gaps):  # the rhythm may be another behind a gap
        recording.joined[max((lost - first) // times, 0)] = False
    message = f"{times} rows in each period of the PWM: one of them is used, the row where a new command begins"
    recording.problems.append(Problem("oversampled", message, "", first, rows - len(recording), "one of each is used"))


def _beginning(recording, times: int) -> int | None:
    """The first row of a period: where the commands change; None if they change at no one place."""
    changed = np.zeros(len(recording) - 1, bool)
    for name in COMMANDS:
        if name in recording.columns:
            changed |= np.diff(recording[name]) != 0.0
    rows = np.flatnonzero(changed) + 1
    if len(rows) < LEAST:
        return None
    places = np.bincount(rows % times, minlength=times)
    first = int(np.argmax(places))
    return first if places[first] > RHYTHM * len(rows) else None
