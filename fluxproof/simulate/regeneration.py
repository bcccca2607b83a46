# SPDX-License-Identifier: BSD-3-Clause
"""What braking gives back, and what the bus needs for it: volts, joules, a brake resistor.

Let W be the energy that the motor has taken from the bus.  The most that comes back without a pause is the largest fall
of W; a capacitor alone ends at

    u = sqrt(u_dc**2 + 2*E/C)

and a chopper that holds u_on against the largest power P needs at most R = u_on**2/P.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fluxproof.simulate.run import Run
from golden_model.drive import Drive
from golden_model.registers import registers


@dataclass(frozen=True)
class Regeneration:
    """What comes back, the bus voltage without a brake resistor, and the resistor from ``on_v`` on that holds it."""

    energy_j: float
    power_w: float
    volts: float
    on_v: float
    resistor_ohm: float


def regeneration(drive: Drive, run: Run) -> Regeneration:
    """Of a run whose gates stay on: on the ideal bus, where the real one trips."""
    taken = np.concatenate([[0.0], np.cumsum(run["true_power"]) * drive.sample_time_s])
    energy = float((np.maximum.accumulate(taken) - taken).max())
    power = float(max(-run["true_power"].min(), 0.0))
    bus = drive.inverter.dc_bus_v
    on = drive.protection.brake_on_v or (bus + trip_v(drive)) / 2.0
    resistor = on**2 / power if power > 0.0 else math.inf
    return Regeneration(energy, power, math.sqrt(bus**2 + 2.0 * energy / drive.supply.capacitance_f), on, resistor)


def trip_v(drive: Drive) -> float:
    """The bus voltage that trips u_dc_high [V]."""
    return next(row.represented for row in registers(drive).rows if row.name == "u_dc_max")


def told(drive: Drive, found: Regeneration) -> str:
    """What a reversal needs, for a drive whose bus has tripped."""
    farad = drive.supply.capacitance_f
    back = f"braking feeds back {found.energy_j:.3g} J, which take {farad * 1e3:.3g} mF to {found.volts:.4g} V"
    if drive.protection.brake_on_v is None:
        needs = f"a brake resistor of at most {found.resistor_ohm:.3g} ohm from {found.on_v:.4g} V on (brake_on_v)"
    else:
        needs = f"a brake resistor of at most {found.resistor_ohm:.3g} ohm"
    others = "a [supply] that takes it back, or less braking current (regen_start_v)"
    return f"{back}, u_dc_max is {trip_v(drive):.4g} V: it needs {needs}, {others}"
