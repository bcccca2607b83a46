# SPDX-License-Identifier: BSD-3-Clause
"""[supply] of drive.toml, optional: what feeds the bus.  The core does not know it; `fluxproof simulate` does.

What is not given is ordinary: 1 mF, as on boards of 24 V and in inverters of 15 kW; and for the drive's power
P = 1.5 * u_dc/sqrt(3) * current limit

    resistance      drops 2 % of the bus at P:  R = 0.02*u_dc**2/P
    brake resistor  takes P at brake_on_v:  R = brake_on_v**2/P
"""

import math
from dataclasses import dataclass

from golden_model.drive_keys import choice, not_negative, positive

DROP = 0.02  # of the bus


@dataclass(frozen=True)
class Supply:
    """[supply]; a diode takes nothing back, a battery does, an ideal source has no voltage of its own to raise."""

    source: str = choice(("diode", "battery", "ideal"), "what feeds the bus", "diode")
    capacitance_f: float = positive("F", "of the bus", 1e-3)
    resistance_ohm: float | None = not_negative(
        "ohm", "of the source; 2 % of the bus at the drive's power if none", None
    )
    capacitor_rated_v: float | None = positive("V", "what the capacitor stands; none: not judged", None)
    brake_resistor_ohm: float | None = positive("ohm", "switched by the pin brake; the drive's power if none", None)


def power_w(drive):
    """The largest electrical power at the current limit [W]."""
    return 1.5 * drive.inverter.dc_bus_v / math.sqrt(3.0) * drive.current_limit_a


def resistance_ohm(drive):
    """As given, or ordinary [ohm]."""
    given = drive.supply.resistance_ohm
    return DROP * drive.inverter.dc_bus_v**2 / power_w(drive) if given is None else given


def brake_resistor_ohm(drive):
    """As given, or ordinary [ohm]; inf without a chopper."""
    on = drive.protection.brake_on_v
    if on is None:
        return math.inf
    given = drive.supply.brake_resistor_ohm
    return on**2 / power_w(drive) if given is None else given
