# SPDX-License-Identifier: BSD-3-Clause
"""Whether enough usable rows remain for a diagnosis."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem

STAGE = "extent"
LEAST_ROWS = 400  # two blocks of a balance in time
LEAST_SLOW_ROWS = 20
LEAST_POINTS = 1


def _advice(recording) -> str:
    """What would do instead."""
    if recording.points:
        return ": add operating points of different speed and current"
    if recording.slow:
        return ": record longer"
    return ": record longer, or give operating points as rows of i_d, i_q, u_d_ref, u_q_ref and omega_e without a time"


def check(recording, nominal) -> None:
    n = len(recording)
    good = recording.usable if recording.slow else recording.usable & recording.joined
    left, least = int(np.count_nonzero(good)), LEAST_SLOW_ROWS if recording.slow else LEAST_ROWS
    least = LEAST_POINTS if recording.points else least
    if left >= least:
        return
    message = f"{left} of {n} rows can be used, at least {least} are needed{_advice(recording)}"
    recording.problems.append(Problem("too_short", message, "", 0, n, fatal=True))
