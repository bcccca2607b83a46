"""Angle and speed that disagree: a speed of the shaft or of the wrong sign beside an electrical angle.

The angle is believed where currents and duties were checked against it; where they cannot be (standstill, dq values),
a contradiction in sign is left to the diagnosis and said.
"""

from __future__ import annotations

from diagnosis.checks.agreement import angle_speed_ratio
from diagnosis.recording import Problem

STAGE = "geometry"
LARGE = 0.05  # a speed estimate may lag or be scaled; more is another quantity


def check(recording, nominal) -> None:
    if recording.slow:
        return
    ratio = angle_speed_ratio(recording, nominal.sample_time_s)
    if ratio is None or abs(ratio - 1.0) <= LARGE:
        return
    n = len(recording)
    if abs(ratio + 1.0) <= LARGE:
        if recording.has("d_a", "i_a"):
            recording.columns["omega_e"] = -recording["omega_e"]
            action = "the speed is turned round: the angle fits the currents and duties"
            recording.problems.append(
                Problem("rotation", "speed and angle have opposite signs", "omega_e", 0, n, action)
            )
        else:
            message = "speed and angle have opposite signs; which is right cannot be told from dq values"
            recording.problems.append(Problem("rotation", message, "omega_e", 0, n, "the speed is believed"))
            recording.columns["theta_e"] = -recording["theta_e"]
        return
    message = f"the angle advances {ratio:.3g} times as fast as the speed says"
    recording.problems.append(
        Problem("angle_speed", message, "omega_e", 0, n, "the speed is taken from the angle")
    )
    recording.columns["omega_e"] = recording["omega_e"] * ratio
