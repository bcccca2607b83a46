# SPDX-License-Identifier: BSD-3-Clause
"""A logger that is faster than what it records writes every row several times: one row of each is kept.

Equal neighbours occur by chance too, in channels of few codes; a logger's come in a fixed rhythm.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.missing import keep_rows
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "time"
AFTER = ("oversampled",)
LEAST_DIFFERENT = 100  # different rows
REGULAR = 0.9  # share of them that are written equally often
CLOSE = 0.02  # of the angle's advance


def check(recording, nominal) -> None:
    n = len(recording)
    if recording.points or n < 2 * LEAST_DIFFERENT:
        return
    new = np.ones(n, bool)
    new[1:] = ~np.all([v[1:] == v[:-1] for name, v in recording.columns.items() if name != "t"], axis=0)
    first = np.flatnonzero(new)
    if len(first) < LEAST_DIFFERENT:
        return
    often = np.diff(first)
    times = int(np.median(often))
    if times < 2 or np.mean(often == times) < REGULAR:
        return
    since = np.arange(n) - first[np.cumsum(new) - 1]  # a drive at rest holds rows for longer, and they all count
    step = float(np.median(np.diff(recording["t"])))
    keep_rows(recording, np.flatnonzero(since % times == 0))
    recording.joined[:-1] = True
    message = f"every row is repeated: {times} equal ones follow each other, as the log is faster than its signals"
    action = "one of each is used"
    ratio = angle_speed_ratio(recording, step)
    if ratio is not None and abs(ratio - 1.0) < CLOSE:  # the angle moves on as if only the others had not been written
        t = recording["t"]
        recording.columns["t"] = t[0] + (t - t[0]) / times
        action += f", {step:g} s apart by the angle"
    elif abs(step - nominal.sample_time_s) < CLOSE * step:
        action += f"; if the control samples every {times * step:g} s, correct sample_time_s"
    recording.problems.append(Problem("repeated", message, "", 1, n - len(recording), action))
