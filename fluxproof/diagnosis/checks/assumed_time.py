# SPDX-License-Identifier: BSD-3-Clause
"""A file without a time, whose rows are taken as one sample time of the drive file apart: what confirms it.

A recorded angle that advances with the recorded speed does.  Else the answer rests on an assumption, which its headline
tells, as it does where even the sample time was not stated but follows from the frequency of the pulses.
"""

from __future__ import annotations

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "extent"
AGREES = 0.03
CODE = "assumed_time"
MANY = 100  # rows: more than anybody lists by hand


def check(recording, nominal) -> None:
    if recording.points and "time" in recording.lacks and len(recording) >= MANY:
        message = f"the file has no time: each of the {len(recording)} rows is taken as one operating point"
        recording.problems.append(Problem(CODE, message, "t", -1, 0, "assumed"))
    step = recording.meta.get("assumed_step_s")
    if step is None or recording.points:
        return
    given = nominal.control.sample_time_s is not None
    if given and _confirmed(recording, step):
        return
    by = "by [control] sample_time_s" if given else "as [control] sample_time_s is not stated, by pwm_frequency_hz"
    message = f"the file has no time: rows are assumed to be {ascii_of(quantity(step, 's'))} apart, {by}"
    recording.problems.append(Problem(CODE, message, "t", -1, 0, "assumed"))


def _confirmed(recording, step) -> bool:
    """Whether angle and speed, both recorded, agree with the step."""
    if not {"theta_e", "omega_e"} <= set(recording.meta.get("columns", ())):
        return False
    ratio = angle_speed_ratio(recording, step)
    return ratio is not None and abs(abs(ratio) - 1.0) < AGREES
