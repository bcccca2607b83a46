# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of the state between two switching instants.

State: flux linkage alpha, beta [Wb]; electrical angle; shaft speed [rad/s]; bus [V]; current of shorted turns [A];
integral of the load machine [Nm]; voltage alpha, beta that drives the eddy currents [V], late by their diffusion;
energies [J] into the terminals, into copper, into core and short, to the shaft, out of the bus.
"""

from __future__ import annotations

import math

from numba import njit

from studies.blind.circuit import inverter
from studies.blind.circuit.iron import circuit

LAM_A, LAM_B, THETA, SPEED, BUS, SHORT, LOAD, EDDY_A, EDDY_B, E_IN, E_COPPER, E_CORE, E_SHAFT, E_BUS = range(14)
STATES = 14
HALF3 = math.sqrt(3.0) / 2.0


@njit(cache=True)
def resistances(m, winding, alpha, t):
    """Resistances (aa, ab, bb) in stator coordinates [Ohm] at a winding's temperature [degC] and an instant.

    The star point is not connected, so that the drops' mean over the phases moves it only.
    """
    warm = m.r * (1.0 + alpha * (winding - 25.0))
    shake = math.sin(2.0 * math.pi * m.loose_hz * t) + 0.6 * math.sin(2.0 * math.pi * 2.37 * m.loose_hz * t)
    a = warm * (1.0 + m.r_a) + m.loose_r * max(0.0, shake) ** 2
    b, c = warm * (1.0 + m.r_b), warm * (1.0 + m.r_c)
    return (4.0 * a + b + c) / 6.0, (c - b) / (2.0 * math.sqrt(3.0)), 0.5 * (b + c)


@njit(cache=True)
def currents(m, psi, y):
    """(i_alpha, i_beta, hysteresis alpha, beta, torque, field energy): what flux, core and shorted turns take."""
    i_a, i_b, torque, energy = circuit(m, psi, y[LAM_A], y[LAM_B], y[THETA])
    loss = math.tanh(m.pole_pairs * y[SPEED] / 30.0) * m.g_hysteresis  # in the direction of the voltage, not its size
    h_a, h_b = -loss * y[LAM_B], loss * y[LAM_A]
    i_a += h_a + m.g_eddy * y[EDDY_A] + m.short_share * y[SHORT] * 2.0 / 3.0
    i_b += h_b + m.g_eddy * y[EDDY_B]
    x2 = y[EDDY_A] ** 2 + y[EDDY_B] ** 2
    energy += 0.75 * m.g_eddy * m.t_eddy * x2 + 0.5 * m.short_l * y[SHORT] ** 2
    return i_a, i_b, h_a, h_b, torque, energy


@njit(cache=True)
def slopes(m, v, bench, psi, r, level, goal, t, y, out):
    """dy/dt for the levels of the legs."""
    i_a, i_b, h_a, h_b, torque, _ = currents(m, psi, y)
    i_1, i_2 = -0.5 * i_a + HALF3 * i_b, -0.5 * i_a - HALF3 * i_b
    u_0, u_1, u_2 = (
        inverter.leg(v, level[0], y[BUS], i_a), inverter.leg(v, level[1], y[BUS], i_1),
        inverter.leg(v, level[2], y[BUS], i_2),
    )  # fmt: skip
    u_a, u_b = (2.0 * u_0 - u_1 - u_2) / 3.0, (u_1 - u_2) / math.sqrt(3.0)
    drop_a, drop_b = r[0] * i_a + r[1] * i_b, r[1] * i_a + r[2] * i_b
    e_a, e_b = u_a - drop_a, u_b - drop_b
    drawn = level[0] * i_a + level[1] * i_1 + level[2] * i_2
    out[LAM_A], out[LAM_B] = e_a, e_b
    out[THETA] = m.pole_pairs * y[SPEED]
    fast = y[SPEED] - goal
    rub = m.friction * math.tanh(y[SPEED] / 0.5)
    out[SPEED] = (torque - rub - bench.kp * fast - y[LOAD]) / (m.inertia + bench.inertia)
    out[LOAD] = bench.ki * fast
    out[BUS] = (inverter.supply(v, t, y[BUS]) - drawn) / v.c_bus
    out[SHORT] = (m.short_share * e_a - m.short_r * y[SHORT]) / m.short_l
    out[EDDY_A], out[EDDY_B] = (e_a - y[EDDY_A]) / m.t_eddy, (e_b - y[EDDY_B]) / m.t_eddy
    out[E_IN] = 1.5 * (u_a * i_a + u_b * i_b)
    out[E_COPPER] = 1.5 * (drop_a * i_a + drop_b * i_b)
    eddy = 1.5 * m.g_eddy * (y[EDDY_A] ** 2 + y[EDDY_B] ** 2)
    out[E_CORE] = 1.5 * (e_a * h_a + e_b * h_b) + eddy + m.short_r * y[SHORT] ** 2
    out[E_SHAFT] = torque * y[SPEED]
    out[E_BUS] = drawn * y[BUS]
