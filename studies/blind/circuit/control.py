# SPDX-License-Identifier: BSD-3-Clause
"""Current regulator as a 16-bit processor computes it: integers with 15 fractional bits, shifts that round down."""

from __future__ import annotations

import numpy as np
from numba import njit

ONE = 1 << 15
TABLE = np.round(32767.0 * np.sin(2.0 * np.pi * np.arange(1024) / 1024.0)).astype(np.int64)
SQRT3 = 18919  # 1/sqrt(3)
HALF3 = 28378  # sqrt(3)/2


@njit(cache=True)
def turn(x, y, angle, table):
    """(x + j y) exp(j angle); angle: 16 bits a turn."""
    index = (angle >> 6) & 1023
    s, c = table[index], table[(index + 256) & 1023]
    return (x * c - y * s) >> 15, (x * s + y * c) >> 15


@njit(cache=True)
def limited(x, most):
    return max(-most, min(most, x))


@njit(cache=True)
def regulate(k, i, angle, ahead, speed, goal, bus, acc, table, ticks):
    """One step: currents i, references goal, bus and integrators acc as integers; on-times into ticks.

    bus: relative to the range of voltages, as the outputs.  ahead: by how much the rotor turns until the middle of the
    period in which the duties act.  speed: the message's code, for the induced voltage, as old as that is.
    """
    alpha = i[0] - ((i[0] + i[1] + i[2]) // 3)
    beta = ((i[1] - i[2]) * SQRT3) >> 15
    d, q = turn(alpha, beta, -angle, table)
    most = (bus * SQRT3) >> 15
    drop_d, drop_q = ((speed * k.ff_q) >> 10) * goal[1] >> 10, ((speed * k.ff_d) >> 10) * goal[0] >> 10
    known = (-drop_d, drop_q + ((speed * k.ff_psi) >> 16))
    u_d, u_q = 0, 0
    for axis in range(2):
        error = limited(goal[axis] - (d if axis == 0 else q), ONE - 1)
        acc[axis] = limited(acc[axis] + k.ki * error, most << 20)
        u = limited(known[axis] + ((k.kp * error) >> 10) + (acc[axis] >> 20), most)
        if axis == 0:
            u_d = u
        else:
            u_q = u
    a, b = turn(u_d, u_q, angle + ahead, table)
    x, y = a, (b * HALF3) >> 15
    legs = (x, -(x >> 1) + y, -(x >> 1) - y)
    middle = (max(legs[0], legs[1], legs[2]) + min(legs[0], legs[1], legs[2])) >> 1
    for leg in range(3):
        on = k.ticks // 2 + (legs[leg] - middle) * k.ticks // max(bus, 1)
        ticks[leg] = max(k.ticks // 50, min(k.ticks - k.ticks // 50, on))
