# SPDX-License-Identifier: BSD-3-Clause
"""The motor of the FPGA against the double-precision plant over a ride: currents, torque, angle."""

from __future__ import annotations

import math

import numpy as np

from studies.hil.beside_plant import COLUMNS, HELD, OWN, Both, beside_plant
from studies.hil.drive import RATED_A, RATED_NM, ride, servo
from studies.hil.figure import most

AT = {name: k for k, name in enumerate(COLUMNS)}
CURRENT_PERCENT, TORQUE_PERCENT, ANGLE_DEG = 0.1, 0.2, 0.05


def rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


def differences(both: Both) -> dict[str, float]:
    """Currents in percent of the rated rms, torque in percent of the rated one, angles in degrees."""
    off = both.motor - both.plant
    angle = np.degrees(off[:, AT["theta"]])
    return {
        "current": 100 * rms(off[:, :3]) / (RATED_A / math.sqrt(2)),
        "torque": 100 * rms(off[:, AT["torque"]]) / RATED_NM,
        "angle": float(np.abs(angle).max()),
        "drift": abs(float(angle[-1])),
    }


def figures(options) -> list[dict]:
    """The same gates with the shaft held, then a control of its own for each."""
    drive = servo()
    whole = ride(drive, options.seconds)
    rows = []
    for how, words in ((HELD, "same gates"), (OWN, "own control")):
        off = differences(beside_plant(drive, whole, how))
        rows += [
            most(f"currents against the plant, {words}, rms", off["current"], CURRENT_PERCENT, "% of rated rms"),
            most(f"torque against the plant, {words}, rms", off["torque"], TORQUE_PERCENT, "% of rated"),
        ]
    rows += [
        most("angle against the plant, own control, largest", off["angle"], ANGLE_DEG, "degrees"),
        most("angle against the plant, own control, at the end", off["drift"], ANGLE_DEG / 10, "degrees"),
    ]
    return rows
