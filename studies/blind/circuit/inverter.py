# SPDX-License-Identifier: BSD-3-Clause
"""Legs of the inverter and the supply of its bus."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def leg(v, level, bus, i):
    """Voltage of a leg [V]: on-state drops of switch or diode against the current."""
    forward = math.tanh(i / (0.01 * v.rated))
    switch = (forward > 0.0) == (level > 0.5)
    return level * bus - forward * (v.v_switch if switch else v.v_diode) - v.r_on * i


@njit(cache=True)
def edge(v, rises, bus, i, late):
    """Time [s] from the command until the leg's voltage changes.

    The current that flows out holds the leg low until the upper switch closes, and pulls it down when that opens; a
    small current needs longer to charge the leg, at most until the other switch closes.
    """
    on = v.dead + v.t_on * (1.0 + 0.5 * abs(i) / v.rated) + late
    off = v.t_off + 0.5 * v.c_leg * bus / max(abs(i), 1e-9)
    return on if rises == (i > 0.0) else min(off, on)


@njit(cache=True)
def supply(v, t, bus):
    """Current [A] into the bus: a battery behind its resistance, or a three-phase rectifier with a brake chopper."""
    if not v.rectifier:
        return (v.bus - bus) / v.r_bus
    sector = (2.0 * math.pi * v.mains_hz * t) % (math.pi / 3.0) - math.pi / 6.0
    flow = max(0.0, (v.bus * math.cos(sector) - bus) / v.r_bus)
    return flow - max(0.0, (bus - 1.08 * v.bus) / (2.0 * v.r_bus))
