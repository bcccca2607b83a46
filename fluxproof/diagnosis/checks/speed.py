# SPDX-License-Identifier: BSD-3-Clause
"""Inconsistent angle and speed: a speed with a wrong scale or sign next to an electrical angle.

If currents and duties rotate with the angle, the angle is used and the speed is corrected.  If the balance does not
confirm the angle and the two rates differ widely, the recording is rejected.
"""

from __future__ import annotations

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.balance import FIT, discriminates, misfit, rows_of
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "geometry"
LARGE = 0.05  # largest deviation of a lagging or scaled speed estimate; beyond it the unit is wrong
WRONG = 2.0


def check(recording, nominal) -> None:
    if recording.slow:
        return
    ratio = angle_speed_ratio(recording, nominal.sample_time_s)
    if ratio is None or abs(ratio - 1.0) <= LARGE:
        return
    n = len(recording)
    rows = rows_of(recording, nominal)
    confirmed = rows is not None and not rows.steady and discriminates(rows) and misfit(rows) < 2 * FIT
    if abs(ratio + 1.0) <= LARGE:
        message, column = "speed and angle have opposite signs", "omega_e"
        if rows is not None and rows.steady:  # dq values: the speed was checked against them, the angle cannot be
            column = "theta_e"
        recording.columns[column] = -recording[column]
        recording.problems.append(Problem("sign", message, column, 0, n, "corrected"))
        return
    recording.meta["angle_speed"] = ratio  # tells other pole pairs (conventions/restated.py)
    message = f"the angle advances {ratio:.3g} times as fast as the recorded speed"
    if not confirmed and not 1.0 / WRONG < ratio < WRONG:
        message += ": omega_e is electrical; name its unit in [columns], or correct pole_pairs"
        recording.problems.append(Problem("angle_speed", message, "omega_e", 0, n, fatal=True))
        return
    recording.problems.append(Problem("angle_speed", message, "omega_e", 0, n, "the speed is scaled to the angle"))
    recording.columns["omega_e"] = recording["omega_e"] * ratio
