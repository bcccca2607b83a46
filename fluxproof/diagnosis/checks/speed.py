# SPDX-License-Identifier: BSD-3-Clause
"""Inconsistent angle and speed: a speed with a wrong scale or sign next to an electrical angle.

If currents and duties rotate with the angle, the angle is used and the speed is corrected.  If the balance does not
confirm the angle and the two rates differ widely, the recording is rejected, and so is a speed that no machine has.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.balance import FIT, discriminates, misfit, rows_of
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "geometry"
AFTER = ("phases",)
LARGE = 0.05  # largest deviation of a lagging or scaled speed estimate; beyond it the unit is wrong
WRONG = 2.0
MOST_TURNS = 1.0  # electrical, in a period of the control


def check(recording, nominal) -> None:
    if _impossible(recording, nominal) or recording.slow:
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


def _impossible(recording, nominal) -> bool:
    """Report a speed at which no control could turn a voltage, as of an encoder's counts a second; whether it is."""
    if not recording.has("omega_e") or not recording.usable.any() or "inverter" in recording.lacks:
        return False
    omega = float(np.nanmedian(np.abs(recording["omega_e"][recording.usable])))
    period = min(nominal.sample_time_s, 1.0 / nominal.inverter.pwm_frequency_hz)
    turns = omega * period / (2.0 * np.pi)
    if turns < MOST_TURNS:
        return False
    message = (
        f"the speed is {omega:.3g} rad/s electrical in half of the rows, {turns:.2g} turns in each period of "
        f"{period:.3g} s: omega_e has another unit, such as counts a second; name it in [columns], or correct "
        "pwm_frequency_hz"
    )
    recording.problems.append(Problem("speed_range", message, "omega_e", 0, len(recording), fatal=True))
    return True
