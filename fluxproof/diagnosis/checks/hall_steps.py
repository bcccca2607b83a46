# SPDX-License-Identifier: BSD-3-Clause
"""An angle in a few steps per turn, as Hall sensors give it: the balance, which turns with the angle, cannot use it."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import wrapped
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "units"
LEAST_ANGLES, MOST_ANGLES = 3, 12  # different angles per turn
STEPS = 24  # from one angle to the next in the whole recording: a few turns
LARGE = 0.4  # rad of a step: an encoder of a rotor at rest jumps by one code
STILL = 0.5  # least share of rows in which the angle stays: sampling in step with the rotor sees few angles too


def check(recording, nominal) -> None:
    if recording.slow or recording.points or not recording.has("theta_e"):
        return
    theta = recording["theta_e"]
    steps = np.diff(theta)
    moves = np.flatnonzero(steps)
    if not STEPS <= len(moves) <= (1.0 - STILL) * len(steps) or np.median(np.abs(wrapped(steps[moves]))) < LARGE:
        return
    angles = len(np.unique(np.round(np.mod(theta, 2.0 * np.pi), 3)))
    if not LEAST_ANGLES <= angles <= MOST_ANGLES:
        return
    message = (
        f"the angle moves in {angles} steps per turn, like that of Hall sensors: record an encoder angle, or the "
        "angle that the control interpolates; i_d, i_q, u_d_ref and u_q_ref with omega_e need no angle"
    )
    recording.problems.append(Problem("hall_steps", message, "theta_e", int(moves[0]) + 1, len(recording), fatal=True))
