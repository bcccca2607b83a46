# SPDX-License-Identifier: BSD-3-Clause
"""Two-level inverter legs, as Thevenin sources seen by the machine.

Current is positive out of the leg.  A leg is a voltage source v and a slope
resistance r:  u = v - r i, from the negative rail.

    conducting            v                  r
    i > 0, upper switch   u_dc - v_switch    r_switch
    i > 0, lower diode    -v_diode           r_diode
    i < 0, upper diode    u_dc + v_diode     r_diode
    i < 0, lower switch   v_switch           r_switch
"""

from dataclasses import dataclass
from typing import NamedTuple

from fluxproof.plant.jit import njit


@dataclass(frozen=True)
class Inverter:
    """Inverter data; every zero means that the effect is absent.

    dead_time_s and zero_current_a concern the averaged model: the switching
    model gets its dead time from the gate signals and locates zero current itself.
    zero_current_a: half width of the linear zone around zero current, in which
    dead time and drops fade out; zero gives a pure sign function, with which a
    current near zero chatters by dead_time u_dc / L because each sub-step overshoots.
    """

    dead_time_s: float = 0.0
    v_switch_v: float = 0.0
    v_diode_v: float = 0.0
    r_switch_ohm: float = 0.0
    r_diode_ohm: float = 0.0
    zero_current_a: float = 0.0


class InverterParams(NamedTuple):
    """Inverter parameters for the kernels (build with `inverter_params`)."""

    dead_time: float
    v_switch: float
    v_diode: float
    r_switch: float
    r_diode: float
    zero_current: float
    ideal: bool  # no dependence on the current: skipped by the averaged kernel


def inverter_params(inverter):
    """Build InverterParams from an Inverter."""
    i = inverter
    values = (i.dead_time_s, i.v_switch_v, i.v_diode_v, i.r_switch_ohm, i.r_diode_ohm, i.zero_current_a)
    if min(values) < 0.0:
        raise ValueError("inverter parameters must not be negative")
    return InverterParams(*(float(v) for v in values), ideal=not any(values[:5]))


@njit
def averaged_leg(inv, duty, u_dc, current, period_s, half=0):
    """Mean Thevenin source (v [V], r [ohm]) of a leg over one period.

    half: 0, period_s is a whole period; 1 or -1, it is the rising or falling half of one, with a duty of its own.

    Dead time delays every turn-on: with i > 0 the leg's high time shrinks by
    dead_time once per period (v lower by u_dc dead_time / period), with i < 0 it
    grows.  A pulse shorter than the dead time vanishes; a leg that does not
    switch (duty 0 or 1) loses nothing.
    """
    if inv.zero_current > 0.0:
        sign = min(max(current / inv.zero_current, -1.0), 1.0)
    else:
        sign = 1.0 if current > 0.0 else (-1.0 if current < 0.0 else 0.0)
    share = inv.dead_time / period_s
    high = duty
    if half != 0:
        # A rising half has the turn-on of the upper switch, which i > 0 waits for; a falling one that of the lower
        if 0.0 < duty < 1.0:
            lost = min(share, duty) if half > 0 else min(share, 1.0 - duty)
            high -= half * 0.5 * (1.0 + half * sign) * lost
    elif sign > 0.0 and duty < 1.0:
        high -= sign * min(share, duty)
    elif sign < 0.0 and duty > 0.0:
        high -= sign * min(share, 1.0 - duty)
    switch = high if current > 0.0 else 1.0 - high
    drop = switch * inv.v_switch + (1.0 - switch) * inv.v_diode
    slope = switch * inv.r_switch + (1.0 - switch) * inv.r_diode
    return high * u_dc - sign * drop, slope


@njit
def averaged_leg_voltage(inv, duty, u_dc, current, period_s):
    """Mean voltage [V] of a leg against the negative rail at a constant current [A]."""
    v, r = averaged_leg(inv, duty, u_dc, current, period_s)
    return v - r * current


@njit
def switched_leg(inv, upper, lower, u_dc):
    """Leg with constant gates: (v for i > 0, v for i < 0, r for i > 0, r for i < 0).

    At zero current the leg voltage may take any value between the two.  They
    coincide only for a gated leg with ideal devices.
    """
    if upper and lower:
        raise ValueError("shoot-through: upper and lower gate of one leg are both on")
    if upper:
        return u_dc - inv.v_switch, u_dc + inv.v_diode, inv.r_switch, inv.r_diode
    if lower:
        return -inv.v_diode, inv.v_switch, inv.r_diode, inv.r_switch
    return -inv.v_diode, u_dc + inv.v_diode, inv.r_diode, inv.r_diode
