# SPDX-License-Identifier: BSD-3-Clause
"""Three legs between switching instants.

The upper switch of a leg is commanded on around the middle of a carrier period.  A switch turns off at once, its
partner turns on after the dead time; in between, the phase current charges the leg's capacitance until a diode holds
it at a rail: dv/dt = -i/C between 0 and u.
"""

import math

import numba as nb

from studies.blind.sealed.params import LOAD_PEAK

jit = nb.njit(cache=True)
LOW, HIGH, FREE = 0, 1, 2


@jit
def pulses(v, duties, older, shift, up, down):
    """Write the edges up (3,), down (3,) [s] of a carrier period that begins at ``shift``."""
    for x in range(3):
        rise = older[x] if v.load_at == LOAD_PEAK else duties[x]
        up[x] = shift + 0.5 * v.period * (1.0 - rise)
        down[x] = shift + 0.5 * v.period * (1.0 + duties[x])


@jit
def instants(v, up, down, sample, times):
    """Fill ``times`` with the sorted instants of a period [s], from 0 to the period; returns how many."""
    n = 0
    for k in range(v.steps + 1):
        times[n] = v.period * k / v.steps
        n += 1
    for row in range(2):
        for x in range(3):
            for edge in (up[row, x], down[row, x]):
                for t in (edge, edge + v.dead):
                    if 0.0 < t < v.period:
                        times[n] = t
                        n += 1
                    if v.dead == 0.0:
                        break
    if 0.0 < sample < v.period:
        times[n] = sample
        n += 1
    for a in range(1, n):
        t, b = times[a], a - 1
        while b >= 0 and times[b] > t:
            times[b + 1] = times[b]
            b -= 1
        times[b + 1] = t
    return n


@jit
def state(t, up, down, dead, x):
    """LOW, HIGH or FREE of leg x at time t; the two rows of up and down: the earlier and the present pulse."""
    for row in range(2):
        r, f = up[row, x], down[row, x]
        if f <= r:
            continue
        if r + dead <= t < f:
            return HIGH
        if r <= t < r + dead or f <= t < f + dead:
            return FREE
    return LOW


@jit
def drop(v, i):
    """Voltage [V] that the conducting device of a leg takes; odd in the current."""
    if v.v_on == 0.0:
        return 0.0
    return math.copysign(v.v_on * math.log1p(abs(i) / v.i_on) / math.log1p(v.i_rated / v.i_on), i)


@jit
def leg(v, what, node, u, i, h):
    """(mean voltage without the device's drop, voltage at the end) [V] of a leg over h seconds."""
    if what == HIGH:
        return u, u
    if what == LOW:
        return 0.0, 0.0
    rail = 0.0 if i > 0.0 else u
    slope = -i / v.c_leg
    start = min(max(node, 0.0), u)
    way = rail - start
    if abs(slope) * h <= abs(way) or slope == 0.0:
        end = start + slope * h
        return 0.5 * (start + end), end
    needed = way / slope
    return (0.5 * (start + rail) * needed + rail * (h - needed)) / h, rail


@jit
def source(v, t):
    """Voltage of the supply [V]."""
    return v.u_source * (1.0 + v.ripple * math.cos(2.0 * math.pi * v.ripple_hz * t))
