# SPDX-License-Identifier: BSD-3-Clause
"""One substep of machine and shaft: second-order midpoint rule on the stationary flux linkage.

d psi/dt = u - R i;  the iron's branch and a shorted coil are paths beside the winding that see d psi/dt.
"""

import math

import numba as nb

from studies.blind.sealed.magnetics import currents, torque

jit = nb.njit(cache=True)
TURN = complex(-0.5, 0.8660254037844386)


@jit
def phases(z, out):
    """Write the three phase values of a space vector (without zero sequence)."""
    out[0] = z.real
    out[1] = -0.5 * z.real + 0.8660254037844386 * z.imag
    out[2] = -0.5 * z.real - 0.8660254037844386 * z.imag


@jit
def vector(a, b, c):
    """Space vector of three phase values, amplitude invariant."""
    return 2.0 / 3.0 * (a + TURN * b + TURN.conjugate() * c)


@jit
def turn(theta):
    """exp(j theta)."""
    return complex(math.cos(theta), math.sin(theta))


@jit
def friction(m, omega):
    """Torque that opposes the motion [Nm], mechanical speed [rad/s]."""
    x = omega / m.creep
    return m.viscous * omega + (m.coulomb + m.stribeck * math.exp(-0.1 * x * x)) * math.tanh(x)


@jit
def drag(m, theta_m, omega):
    """Friction and cogging [Nm]."""
    return friction(m, omega) + m.cog * math.sin(m.cog_order * theta_m + m.cog_phase)


@jit
def slope_of(m, r, u, i, i_fe, i_short):
    """(d psi/dt, d i_fe/dt, d i_short/dt) at a magnetising current [A], all stationary."""
    total = i + i_fe + 2.0 / 3.0 * m.short_share * i_short
    lost = r * total
    if m.r_phase[0] != 0.0 or m.r_phase[1] != 0.0 or m.r_phase[2] != 0.0:
        a = total.real
        b = -0.5 * a + 0.8660254037844386 * total.imag
        lost += vector(m.r_phase[0] * a, m.r_phase[1] * b, m.r_phase[2] * (-a - b))
    psi = u - lost
    iron = (psi / m.r_fe - i_fe) / m.tau_fe if m.r_fe > 0.0 else 0j
    short = (m.short_share * psi.real / m.r_short - i_short) / m.tau_short if m.short_share > 0.0 else 0.0
    return psi, iron, short


@jit
def substep(m, r, psi_m, u, h, slope, free, load, psi, i_fe, i_short, theta, omega, i_dq):
    """Advance h seconds.

    theta: mechanical [rad]; omega: mechanical [rad/s]; slope: imposed acceleration [rad/s^2] unless free.
    Returns psi, i_fe, i_short, theta, omega, i_dq, and the air-gap torque in the middle [Nm].
    """
    p = m.pole_pairs
    rotor = turn(p * theta)
    k_psi, k_fe, k_short = slope_of(m, r, u, i_dq * rotor, i_fe, i_short)
    if free:
        pull = torque(m, psi_m, psi * rotor.conjugate(), i_dq, p * theta)
        slope = (pull - drag(m, theta, omega) - load) / m.inertia
    half = 0.5 * h
    theta_h, omega_h = theta + half * omega, omega + half * slope
    rotor = turn(p * theta_h)
    psi_h = (psi + half * k_psi) * rotor.conjugate()
    i_h = currents(m, psi_m, psi_h, p * theta_h, i_dq)
    pull = torque(m, psi_m, psi_h, i_h, p * theta_h)
    k_psi, k_fe, k_short = slope_of(m, r, u, i_h * rotor, i_fe + half * k_fe, i_short + half * k_short)
    if free:
        slope = (pull - drag(m, theta_h, omega_h) - load) / m.inertia
    psi, i_fe, i_short = psi + h * k_psi, i_fe + h * k_fe, i_short + h * k_short
    theta, omega = theta + h * omega_h, omega + h * slope
    i_dq = currents(m, psi_m, psi * turn(p * theta).conjugate(), p * theta, i_h)
    return psi, i_fe, i_short, theta, omega, i_dq, pull
