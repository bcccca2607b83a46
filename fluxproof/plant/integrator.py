# SPDX-License-Identifier: BSD-3-Clause
"""Equations of motion of machine and shaft, and the Runge-Kutta step.

Stator frame, flux linkage as state (a constant voltage vector then integrates
exactly; only the resistive drop and the shaft are approximated):

    d psi/dt = u - R_device i_terminal - R (i_terminal - i_s)
    l di_f/dt = mu u_phase - R_s i_f,   i_s = (2/3) mu i_f along the phase   (a short, see `pmsm`)
    d w/dt   = (T - T_load - B w - friction) / J,   d theta/dt = w
"""

import math
from typing import NamedTuple

from fluxproof.plant.jit import njit
from fluxproof.plant.pmsm import currents_from_flux, harmonic_flux


class Drive(NamedTuple):
    """What is constant during one step: sources, resistances, shaft decisions."""

    psi_m: float  # magnet flux at temperature [Wb]
    u_alpha: float  # inverter voltage before its slope resistances [V]
    u_beta: float
    r_aa: float  # winding resistance matrix [ohm]
    r_ab: float
    r_bb: float
    s_aa: float  # slope resistances of the devices, same form [ohm]
    s_ab: float
    s_bb: float
    free: float  # 1.0: torque moves the shaft, 0.0: held or imposed
    friction: float  # Coulomb torque with its sign [Nm]
    load: float  # [Nm]
    acceleration: float  # imposed [rad/s^2]
    short: float  # resistance of the shorted loop [ohm]


class Step(NamedTuple):
    """Result of one step; the means are over that step."""

    lambda_alpha: float
    lambda_beta: float
    omega: float
    theta: float
    i_short: float
    i_alpha: float  # mean terminal current [A]
    i_beta: float
    p_in: float  # mean power into the terminals [W]
    p_copper: float
    p_airgap: float


@njit
def observe(m, psi_m, l_alpha, l_beta, omega, theta, i_short, guess_d, guess_q):
    """Terminal currents (alpha, beta, d, q) [A], torque [Nm], dq flux [Wb], i_m (d, q) [A]."""
    angle = m.pole_pairs * theta
    cosine, sine = math.cos(angle), math.sin(angle)
    l_d, l_q = cosine * l_alpha + sine * l_beta, cosine * l_beta - sine * l_alpha
    h_d = h_q = g_d = g_q = 0.0
    if m.harmonics.shape[0] > 0:
        h_d, h_q, g_d, g_q = harmonic_flux(m, psi_m, theta)
    x_d, x_q = currents_from_flux(m, psi_m, l_d - h_d, l_q - h_q, guess_d, guess_q)
    torque = 1.5 * m.pole_pairs * (l_d * x_q - l_q * x_d + g_d * x_d + g_q * x_q)
    if m.cogging_amplitude != 0.0:
        torque += m.cogging_amplitude * math.sin(m.cogging_order * theta + m.cogging_phase)
    iron = m.iron_conductance * m.pole_pairs * omega
    i_d, i_q = x_d - iron * l_q, x_q + iron * l_d
    i_alpha, i_beta = cosine * i_d - sine * i_q, sine * i_d + cosine * i_q
    if m.shorted_share != 0.0:
        i_alpha, i_beta = i_alpha + m.shorted_alpha * i_short, i_beta + m.shorted_beta * i_short
        i_d, i_q = cosine * i_alpha + sine * i_beta, cosine * i_beta - sine * i_alpha
    return i_alpha, i_beta, i_d, i_q, torque, l_d, l_q, x_d, x_q


@njit
def _slope(m, mech, c, l_alpha, l_beta, omega, theta, i_short, guess_d, guess_q):
    """Derivatives (psi_alpha, psi_beta, omega, i_short), terminal currents and powers."""
    i_alpha, i_beta, _, _, torque, _, _, _, _ = observe(
        m, c.psi_m, l_alpha, l_beta, omega, theta, i_short, guess_d, guess_q
    )
    u_alpha = c.u_alpha - c.s_aa * i_alpha - c.s_ab * i_beta
    u_beta = c.u_beta - c.s_ab * i_alpha - c.s_bb * i_beta
    w_alpha, w_beta = i_alpha - m.shorted_alpha * i_short, i_beta - m.shorted_beta * i_short
    drop_alpha = c.r_aa * w_alpha + c.r_ab * w_beta
    drop_beta = c.r_ab * w_alpha + c.r_bb * w_beta
    u_short = 1.5 * (m.shorted_alpha * u_alpha + m.shorted_beta * u_beta)
    net = torque - c.load - mech.viscous * omega - c.friction
    return (
        u_alpha - drop_alpha,
        u_beta - drop_beta,
        c.free * mech.inverse_inertia * net + c.acceleration,
        m.shorted_slope * (u_short - c.short * i_short),
        i_alpha,
        i_beta,
        1.5 * (u_alpha * i_alpha + u_beta * i_beta),
        1.5 * (drop_alpha * w_alpha + drop_beta * w_beta) + c.short * i_short * i_short,
        torque * omega,
    )


@njit
def rk4_step(m, mech, c, step_s, start, guess_d, guess_q):
    """One classical Runge-Kutta step of step_s seconds; returns a Step.

    start: (lambda_alpha, lambda_beta, omega, theta, i_short).  step_s may be negative (to look back).  The same weights
    give the means, so psi moves by exactly step x (u - R mean(i)).
    """
    h = 0.5 * step_s
    l_alpha, l_beta, omega, theta, i_short = start
    a1, b1, w1, f1, ia1, ib1, p1, q1, t1 = _slope(m, mech, c, l_alpha, l_beta, omega, theta, i_short, guess_d, guess_q)
    v1 = omega
    v2 = omega + h * w1
    a2, b2, w2, f2, ia2, ib2, p2, q2, t2 = _slope(
        m, mech, c, l_alpha + h * a1, l_beta + h * b1, v2, theta + h * v1, i_short + h * f1, guess_d, guess_q
    )
    v3 = omega + h * w2
    a3, b3, w3, f3, ia3, ib3, p3, q3, t3 = _slope(
        m, mech, c, l_alpha + h * a2, l_beta + h * b2, v3, theta + h * v2, i_short + h * f2, guess_d, guess_q
    )
    v4 = omega + step_s * w3
    a4, b4, w4, f4, ia4, ib4, p4, q4, t4 = _slope(
        m, mech, c, l_alpha + step_s * a3, l_beta + step_s * b3, v4, theta + step_s * v3, i_short + step_s * f3,
        guess_d, guess_q,
    )  # fmt: skip
    s = step_s / 6.0
    return Step(
        l_alpha + s * (a1 + 2.0 * (a2 + a3) + a4),
        l_beta + s * (b1 + 2.0 * (b2 + b3) + b4),
        omega + s * (w1 + 2.0 * (w2 + w3) + w4),
        theta + s * (v1 + 2.0 * (v2 + v3) + v4),
        i_short + s * (f1 + 2.0 * (f2 + f3) + f4),
        (ia1 + 2.0 * (ia2 + ia3) + ia4) / 6.0,
        (ib1 + 2.0 * (ib2 + ib3) + ib4) / 6.0,
        (p1 + 2.0 * (p2 + p3) + p4) / 6.0,
        (q1 + 2.0 * (q2 + q3) + q4) / 6.0,
        (t1 + 2.0 * (t2 + t3) + t4) / 6.0,
    )
