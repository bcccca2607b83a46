# SPDX-License-Identifier: BSD-3-Clause
"""A recording that was made without the trims of the drive file, as its errors show: those that the trims cancel.

Only a dump says which trims ran (replay/trims.py).  In another recording an error of the size that a trim of the file
cancels is that error itself, so that the trim of the file must not be applied to it a second time.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.diagnosis.ground.plant_section import merged
from golden_model.units import TURN_RAD

NEUTRAL = {"theta_offset_rad": 0.0, "current_gain": (1.0, 1.0, 1.0), "u_dc_gain": 1.0}


def given_trims(nominal: Nominal) -> list[str]:
    """The trims of [sensors] that change a reading."""
    return [key for key, neutral in NEUTRAL.items() if getattr(nominal.sensors, key) != neutral]


def without_trims(nominal: Nominal, effects) -> tuple[Nominal, list[str]]:
    """(the drive without the trims whose error the recording still has, their keys)."""
    found, s = merged(effects), nominal.sensors
    lacking = {}
    for key in given_trims(nominal):
        error, cancelled = _errors(key, found, s, nominal.machine.pole_pairs)
        if error is not None and np.linalg.norm(error - cancelled) < k.SAME_TRIM * np.linalg.norm(cancelled):
            lacking[key] = NEUTRAL[key]
    return dataclasses.replace(nominal, sensors=dataclasses.replace(s, **lacking)), list(lacking)


def _errors(key, found, sensors, pole_pairs):
    """(error found in the readings or None, error that the trim of the file cancels), of one key."""
    if key == "theta_offset_rad":
        turned = found.get("sensors.position_offset_rad", (None,))[0]
        error = None if turned is None else np.array([math.remainder(pole_pairs * turned, TURN_RAD)])
        return error, np.array([-math.remainder(sensors.theta_offset_rad, TURN_RAD)])
    gain = found.get(f"sensors.{key}_error", (None,))[0]
    return None if gain is None else np.atleast_1d(gain), 1.0 / np.atleast_1d(getattr(sensors, key)) - 1.0
