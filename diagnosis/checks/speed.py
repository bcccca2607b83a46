"""Angle and speed that disagree: a speed of another scale or sign beside an electrical angle.

The angle is believed where the currents and duties turn with it, and the speed is then set by it.  An angle that the
balance does not confirm and that turns at quite another rate than the speed leaves nothing to believe.
"""

from __future__ import annotations

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.balance import FIT, misfit, rows_of, tells
from fluxproof.diagnosis.recording import Problem

STAGE = "geometry"
LARGE = 0.05  # a speed estimate may lag or be scaled; more is another quantity
WRONG = 2.0


def check(recording, nominal) -> None:
    if recording.slow:
        return
    ratio = angle_speed_ratio(recording, nominal.sample_time_s)
    if ratio is None or abs(ratio - 1.0) <= LARGE:
        return
    n = len(recording)
    rows = rows_of(recording, nominal)
    confirmed = rows is not None and not rows.steady and tells(rows) and misfit(rows) < 2 * FIT
    if abs(ratio + 1.0) <= LARGE:
        message = "speed and angle have opposite signs"
        if (
            rows is not None and rows.steady
        ):  # dq values: the speed was checked against them, the angle cannot be
            recording.columns["theta_e"] = -recording["theta_e"]
            action = "the speed is believed"
        else:
            recording.columns["omega_e"] = -recording["omega_e"]
            action = "the angle is believed, the speed turned round"
        recording.problems.append(Problem("rotation", message, "omega_e", 0, n, action))
        return
    message = f"the angle advances {ratio:.3g} times as fast as the speed says"
    if not confirmed and not 1.0 / WRONG < ratio < WRONG:
        recording.problems.append(Problem("angle_speed", message, "omega_e", 0, n, fatal=True))
        return
    recording.problems.append(
        Problem("angle_speed", message, "omega_e", 0, n, "the speed is taken from the angle")
    )
    recording.columns["omega_e"] = recording["omega_e"] * ratio
