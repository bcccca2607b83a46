# SPDX-License-Identifier: BSD-3-Clause
"""Angles in degrees, turns or codes, angles and speeds of the shaft, speeds in rpm: recognised by the fit, converted.

Each unit of the angle is tested with the nominal stator balance; each unit of the speed with the advance of the angle,
or without an angle with the steady dq balance.  A unit is accepted only if the unchanged columns do not fit and it
fits best.
"""

from __future__ import annotations

import math

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.balance import BETTER, FIT, FastRows, SteadyRows, discriminates, misfit, rows_of
from fluxproof.diagnosis.checks.rival_readings import CLEAR, best_reading, misfit_of
from fluxproof.diagnosis.conventions.units import angle_units, speed_units
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "units"
CLOSE = 0.05
LEAST_BITS = 9  # of an encoder: 0 to 360 may be degrees


def check(recording, nominal) -> None:
    p = nominal.machine.pole_pairs
    n = len(recording)
    angle = _angle_unit(recording, nominal, p)
    if angle:
        unit, factor = angle
        recording.columns["theta_e"] = recording["theta_e"] * factor
        recording.problems.append(Problem("unit", f"the angle is in {unit}", "theta_e", 0, n, "converted"))
    speed = _speed_unit(recording, nominal, p)
    if isinstance(speed, Problem):
        recording.problems.append(speed)
    elif speed:
        unit, factor = speed
        recording.columns["omega_e"] = recording["omega_e"] * factor
        recording.problems.append(Problem("unit", f"the speed is in {unit}", "omega_e", 0, n, "converted"))


def _angle_unit(recording, nominal, p):
    """(unit, factor) of an angle that is not in electrical rad, else None."""
    if "theta_e" not in recording.columns or recording.slow:
        return None
    without_speed = "omega_e" not in recording.columns
    if without_speed:  # the balance does not use it, but rows_of requires the column
        recording.columns["omega_e"] = np.zeros(len(recording))
    rows = rows_of(recording, nominal)
    if without_speed:
        del recording.columns["omega_e"]
    units = angle_units(p, _bits(recording["theta_e"])) | _as_numbered(recording)
    if isinstance(rows, FastRows) and discriminates(rows):
        as_is = _best_direction(rows, 1.0)
        if as_is <= FIT:
            return None
        tried = {unit: _best_direction(rows, factor) for unit, factor in units.items()}
        best = min(tried, key=tried.__getitem__)
        if tried[best] < min(FIT, BETTER * as_is):
            return best, units[best]
        return None
    if "theta_e" in recording.meta.get("stated_units", ()):
        return None
    # Without a balance only degrees can be recognised, since the ratio of angle and speed is then 180 / pi.
    ratio = angle_speed_ratio(recording, nominal.sample_time_s)
    if ratio is not None and abs(abs(ratio) - 1.0) < CLOSE:
        return None
    for unit, factor in units.items():
        ratio = angle_speed_ratio(recording, nominal.sample_time_s, factor)
        if ratio is not None and abs(abs(ratio) - 1.0) < CLOSE and unit.startswith(("degrees", "codes")):
            return unit, factor
    return None


def _bits(theta) -> int | None:
    """Number of bits of an encoder's codes of one turn; None for an angle that is not whole numbers from 0 on."""
    low, high = float(theta.min()), float(theta.max())
    if low < 0.0 or low > 0.02 * high or high < 2**LEAST_BITS / 1.02 or np.any(theta != np.round(theta)):
        return None
    bits = round(math.log2(high + 1.0))
    return bits if (1.0 - 0.02) * 2**bits < high <= 2**bits else None


def _best_direction(rows, factor) -> float:
    """Misfit with the angle times factor, for the better direction and phase sequence."""
    theta = rows.theta * factor
    mirrored = rows.i[..., [0, 2, 1]]
    return min(misfit(rows.change(theta=s * theta, i=i)) for s in (1.0, -1.0) for i in (rows.i, mirrored))


def _as_numbered(recording) -> dict[str, float]:
    """{unit: rad} of an angle whose numbers are in rad although the file states another unit."""
    factor, _ = recording.meta.get("column_scales", {}).get("theta_e", (1.0, 0.0))
    return {} if factor in (0.0, 1.0) else {f"rad, although a unit of {factor:.4g} rad is stated": 1.0 / factor}


def _speed_unit(recording, nominal, p):
    """(unit, factor) of a speed that is not in electrical rad/s, a Problem if nobody can tell, else None."""
    if "omega_e" not in recording.columns or "omega_e" in recording.meta.get("stated_units", ()):
        return None
    units = speed_units(p)
    if not recording.slow and "theta_e" in recording.columns:
        period = nominal.sample_time_s
        ratio = angle_speed_ratio(recording, period)
        if ratio is not None and abs(abs(ratio) - 1.0) < CLOSE:
            return None
        ratios = {u: angle_speed_ratio(recording, period, 1.0, factor) for u, factor in units.items()}
        off = {u: abs(abs(ratio) - 1.0) for u, ratio in ratios.items() if ratio is not None}
        # The nearest: six pole pairs and the 2 pi of a frequency are 5 % apart.
        nearest = min(off, key=off.__getitem__, default=None)
        if nearest and off[nearest] < CLOSE:
            return nearest, units[nearest]
        return None
    rows = rows_of(recording, nominal)
    if not isinstance(rows, SteadyRows) or not discriminates(rows):
        return None
    as_is = _either_sign(rows, 1.0)
    tried = {unit: _either_sign(rows, factor) for unit, factor in units.items()}
    ranked = sorted(tried, key=tried.__getitem__)
    best = tried[ranked[0]]
    clear = len(ranked) < 2 or tried[ranked[1]] > 2 * best
    if not (as_is > 2 * FIT and best < min(FIT, BETTER * as_is) and clear):
        return None
    rival, reading = best_reading(rows, nominal)
    if CLEAR * rival < best:  # conventions/ tells it
        return None
    if rival < CLEAR * best:
        message = f"the speed is in {ranked[0]}, or {reading.says}: name the unit of omega_e in [columns]"
        return Problem("unit", message, "omega_e", 0, len(recording), fatal=True)
    return ranked[0], units[ranked[0]]


def _either_sign(rows, factor) -> float:
    return min(misfit_of(rows.change(omega=sign * factor * rows.omega)) for sign in (1.0, -1.0))
