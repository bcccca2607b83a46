# SPDX-License-Identifier: BSD-3-Clause
"""The bus of an inverter: capacitor, source with resistance and perhaps a diode, brake resistor.

    C du/dt = (E - u)/R_s - P/u - u/R_b        source: not below zero behind a diode; R_b: while it is switched on

A period is one step of the implicit Euler method, which any R_s*C leaves stable; P is the period's mean power into the
motor, negative while it brakes.
"""

from typing import NamedTuple

import numpy as np

from fluxproof.plant.jit import njit

LEAST = 0.01  # of the source's voltage: below, P/u is that of a resistor


class Bus(NamedTuple):
    """Capacitance [F], 0: an ideal source; resistances [ohm]; whether the source takes nothing back."""

    capacitance: float = 0.0
    source_ohm: float = 0.0
    diode: bool = False
    brake_ohm: float = np.inf


@njit
def advance_bus(u, bus, source, power, brake, period_s):
    """Bus voltage [V] one period later; ``source`` [V], ``power`` [W] into the motor, ``brake`` 1: resistor on."""
    if bus.capacitance <= 0.0:
        return source
    share = period_s / bus.capacitance
    taken = share * power / max(u, LEAST * source)
    loss = share / bus.brake_ohm if brake == 1 else 0.0
    alone = (u - taken) / (1.0 + loss)
    if bus.source_ohm > 0.0:
        fed = share / bus.source_ohm
        joined = (u - taken + fed * source) / (1.0 + loss + fed)
    else:
        joined = source
    if bus.diode and alone >= source:
        return alone
    return max(joined, 0.0)
