# SPDX-License-Identifier: BSD-3-Clause
"""Three inverter legs between switching instants: commands, dead time, commutation by current direction, drops.

Centre-aligned PWM: the upper switch is commanded on from t1 = T(1 - d)/2 to t2 = T(1 + d)/2.  Each turn-on is delayed
by the dead time.  While both switches are off, the conducting diode determines the voltage; within a zone around zero
current the leg voltage lies in between, which clamps the current softly.
"""

import math

import numba as nb

from studies.blind import params as P

jit = nb.njit(cache=True, fastmath=False)
LOW, HIGH, DEAD = 0, 1, 2


@jit
def direction(kind, i_zone, i):
    """Share of the dead-time loss, -1 to 1, at a phase current [A]."""
    x = i / i_zone
    if kind == P.DIRECTION_CLIP:
        return min(max(x, -1.0), 1.0)
    if kind == P.DIRECTION_TANH:
        return math.tanh(x)
    if kind == P.DIRECTION_ATAN:
        return math.atan(1.5 * x) * 2.0 / math.pi
    if abs(x) < 1.0:  # DIRECTION_CAPACITANCE: the current charges the leg capacitance in 1/x dead times
        return 0.5 * x
    return math.copysign(1.0 - 0.5 / abs(x), x)


@jit
def drop(b, i):
    """Voltage [V] that devices take at a current [A] out of the leg; odd."""
    if b.drop == P.DROP_NONE:
        return 0.0
    x = i / b.i_drop
    if b.drop == P.DROP_CONSTANT:
        return b.v_drop * min(max(x, -1.0), 1.0) + b.r_drop * i
    if b.drop == P.DROP_DIODE:
        return b.v_drop * math.asinh(x) + b.r_drop * i
    return b.v_drop * math.atan(x) * 2.0 / math.pi + b.r_drop * i


@jit
def leg_state(t, t1, t2, dead_s):
    """LOW, HIGH or DEAD at time t of a period; a pulse shorter than the dead time never turns on."""
    if t < t1 or t >= t2 + dead_s or t2 <= t1:
        return LOW
    if t < t1 + dead_s or t >= t2:
        return DEAD
    return HIGH


@jit
def leg_voltage(b, state, u_dc, i):
    """Potential [V] of the leg's output against the negative rail at a current [A] out of it."""
    if state == HIGH:
        return u_dc - drop(b, i)
    if state == LOW:
        return -drop(b, i)
    return 0.5 * u_dc * (1.0 - direction(b.direction, b.i_zone, i)) - drop(b, i)


@jit
def pulse(b, duties, before, period_s, t1, t2):
    """Edges t1, t2 (3,) [s] of the period in which ``duties`` are in force; ``before``: the older duties."""
    for x in range(3):
        rise, fall = duties[x], duties[x]
        if b.delay_kind == P.DELAY_MIX and b.delay > 0.0:  # an interpolating modulator
            rise = fall = (1.0 - b.delay) * duties[x] + b.delay * before[x]
        elif b.delay_kind == P.DELAY_HALF:  # compare registers load at the carrier's peak
            rise = before[x]
        loss = b.leg_a if x == 0 else b.leg_b if x == 1 else b.leg_c
        t1[x] = 0.5 * period_s * (1.0 - rise * (1.0 - loss))
        t2[x] = 0.5 * period_s * (1.0 + fall * (1.0 - loss))
