# SPDX-License-Identifier: BSD-3-Clause
"""Field-oriented control: current regulator with internal-model gains, speed regulator, modulation."""

import math

import numba as nb

from studies.blind.sealed.machine import phases, turn
from studies.blind.sealed.params import MIDDLE, THIRD
from studies.blind.sealed.sensors import wrap

jit = nb.njit(cache=True)
D_MIN = 0.02
# places in the regulators' memory
INTEGRAL_D, INTEGRAL_Q, ANGLE, SPEED, SPEED_INTEGRAL, LAST_Q = range(6)
MEMORY = 6


@jit
def track_speed(c, theta_e, memory):
    """Electrical speed [rad/s] of a phase-locked loop on the measured angle."""
    a = c.speed_filter * c.period
    memory[ANGLE] = wrap(memory[ANGLE] + c.period * memory[SPEED])
    error = wrap(theta_e - memory[ANGLE])
    memory[ANGLE] += 2.0 * a * error
    memory[SPEED] += a * a / c.period * error
    return memory[SPEED]


@jit
def speed_regulator(c, omega_goal, omega_e, memory):
    """Current reference [A] for a goal of the electrical speed."""
    a, p = c.speed_bandwidth, c.pole_pairs
    error = (omega_goal - omega_e) / p
    q = abs(memory[LAST_Q])
    k = 1.5 * p * (c.psi - (c.l_d - c.l_q) * c.d_share * q)
    limit = 0.95 * c.current / math.sqrt(1.0 + c.d_share**2)
    wanted = c.inertia * a * error + memory[SPEED_INTEGRAL]
    i_q = min(max(wanted / k, -limit), limit)
    if abs(wanted / k) < limit:
        memory[SPEED_INTEGRAL] += c.period * c.inertia * 0.25 * a * a * error
    memory[LAST_Q] = i_q
    return complex(-c.d_share * abs(i_q), i_q)


@jit
def current_regulator(c, goal, i, omega_e, u_dc, memory):
    """Voltage [V] in rotor axes for a current reference [A]."""
    a, w = c.bandwidth, omega_e
    e = goal - i
    l_e = complex(c.l_d * e.real, c.l_q * e.imag)
    l_i = complex(c.l_d * i.real, c.l_q * i.imag)
    u = complex(memory[INTEGRAL_D], memory[INTEGRAL_Q]) + a * l_e + 1j * w * c.psi - c.damping * a * l_i
    growth = a * (c.r * e + c.damping * a * l_e)
    if c.complex_vector:
        growth += 1j * w * a * l_e
    else:
        u += 1j * w * l_i
    limit = 0.57 * u_dc
    if abs(u) > limit:
        u *= limit / abs(u)
    else:
        memory[INTEGRAL_D] += c.period * growth.real
        memory[INTEGRAL_Q] += c.period * growth.imag
    return u


@jit
def modulate(c, u, angle, u_dc, out):
    """Write three duties for a voltage [V] in rotor axes at an angle [rad], in whole ticks of the counter."""
    z = u * turn(angle)
    phases(z, out)
    zero = 0.0
    if c.modulation == MIDDLE:
        zero = -0.5 * (max(out[0], out[1], out[2]) + min(out[0], out[1], out[2]))
    elif c.modulation == THIRD and abs(z) > 0.0:
        y = z / abs(z)
        zero = -abs(z) / 6.0 * (y * y * y).real
    for x in range(3):
        d = 0.5 + (out[x] + zero) / u_dc
        out[x] = math.floor(min(max(d, D_MIN), 1.0 - D_MIN) * c.ticks + 0.5) / c.ticks
