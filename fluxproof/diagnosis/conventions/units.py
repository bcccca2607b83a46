# SPDX-License-Identifier: BSD-3-Clause
"""Units in which a column may be although nothing says so: what checks/unit_angle.py and checks/sizes.py try.

Each is a number of the canonical unit; a share of a duty cycle is written as what makes one.
"""

from __future__ import annotations

import math

TURN = 2.0 * math.pi
OF_CURRENT = {"mA": 1e-3}
OF_VOLTAGE = {"mV": 1e-3}
OF_BUS_VOLTAGE = {"mV": 1e-3, "kV": 1e3}
IN_A_DUTY = {"percent": 100.0, "permille": 1000.0}
PREFIXES = (1e-6, 1e-3, 1e3, 1e6)  # between the unit that is stated and the right one
KELVIN = -273.15  # offset to degC


def angle_units(p, bits=None) -> dict[str, float]:
    """{unit: rad} of an angle that is not in electrical rad; p: pole pairs, bits: of an encoder's codes, or None."""
    units = {"degrees": math.pi / 180, "turns": TURN} | ({f"codes of {bits} bits": TURN / 2**bits} if bits else {})
    if p > 1:
        units |= {
            "rad of the shaft": p,
            "degrees of the shaft": p * math.pi / 180,
            "turns of the shaft": p * TURN,
        }
    return units


def speed_units(p) -> dict[str, float]:
    """{unit: rad/s} of a speed that is not in electrical rad/s; p: pole pairs."""
    units = {"electrical rpm": TURN / 60, "electrical Hz": TURN}
    if p > 1:
        units |= {
            "rad/s of the shaft": p,
            "rpm of the shaft": p * TURN / 60,
            "turns/s of the shaft": p * TURN,
        }
    else:
        units = {"rpm": TURN / 60, "turns/s": TURN}
    return units
