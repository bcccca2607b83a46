# SPDX-License-Identifier: BSD-3-Clause
"""The magnetic circuit: teeth and yoke of the stator and iron of the rotor, in series with gap, leakage and magnets.

The flux linkage is the state, so that each path's flux density is known and its magnetomotive force explicit:
i = dW/dlambda with the field energy W(lambda, theta), torque = -3/2 p dW/dtheta.  Energy is kept by construction.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

LINEAR, KNEE, KNEE_T = 100.0, 650.0, 1.5  # A/m per T, A/m, T: 0.5 mm electrical sheet


@njit(cache=True)
def field(b):
    """Field strength [A/m] at a flux density [T], and its integral [J/m3]."""
    x2 = (b / KNEE_T) ** 2
    x10 = x2 * x2 * x2 * x2 * x2
    return LINEAR * b + KNEE * x10 * b / KNEE_T, 0.5 * LINEAR * b * b + KNEE * KNEE_T / 12.0 * x10 * x2


@njit(cache=True)
def stator(m, alpha, beta):
    """Current [A] that magnetises teeth and yoke, in stator coordinates, and the energy over 3/2 [J]."""
    i_a, i_b, energy = 0.0, 0.0, 0.0
    half = m.teeth // 2  # the other half has the opposite flux
    for k in range(half):
        for shift, tesla in ((0.0, m.tooth_t), (0.5, m.yoke_t)):
            angle = math.pi * (k + shift) / half
            c, s = math.cos(angle), math.sin(angle)
            h, w = field(tesla * (alpha * c + beta * s))
            i_a += h * c
            i_b += h * s
            energy += w / tesla
    scale = m.iron_m / half
    return scale * i_a, scale * i_b, scale * energy


@njit(cache=True)
def magnets(m, psi, theta):
    """Flux of the magnets in the dq frame and its derivative to the angle."""
    x, y = 6.0 * theta + m.emf_phase, 12.0 * theta + 2.0 * m.emf_phase
    d = psi * (1.0 + m.emf_6 * math.cos(x) + m.emf_12 * math.cos(y))
    q = psi * m.emf_q * (m.emf_6 * math.sin(x) + m.emf_12 * math.sin(y))
    dd = -psi * (6.0 * m.emf_6 * math.sin(x) + 12.0 * m.emf_12 * math.sin(y))
    dq = psi * m.emf_q * (6.0 * m.emf_6 * math.cos(x) + 12.0 * m.emf_12 * math.cos(y))
    return d, q, dd, dq


@njit(cache=True)
def circuit(m, psi, alpha, beta, theta):
    """(i_alpha, i_beta, torque [Nm], field energy [J]) of a flux linkage [Wb] at an electrical angle."""
    c, s = math.cos(theta), math.sin(theta)
    lam_d, lam_q = c * alpha + s * beta, c * beta - s * alpha
    mag_d, mag_q, turn_d, turn_q = magnets(m, psi, theta)
    pulse = 1.0 + m.slot * math.cos(m.teeth * theta)
    x_d, x_q = lam_d - mag_d, lam_q - mag_q
    gap_d, gap_q = m.gap_d * pulse * x_d, m.gap_q * pulse * x_q
    still = 0.5 * (m.gap_d * x_d * x_d + m.gap_q * x_q * x_q)
    h_d, w_d = field(m.bridge_d_t * lam_d)
    h_q, w_q = field(m.bridge_q_t * lam_q)
    i_d, i_q = gap_d + m.iron_m * h_d, gap_q + m.iron_m * h_q
    i_a, i_b, w_s = stator(m, alpha, beta)
    pull = lam_d * i_q - lam_q * i_d + gap_d * turn_d + gap_q * turn_q
    pull += m.slot * m.teeth * math.sin(m.teeth * theta) * still
    energy = pulse * still + m.iron_m * (w_d / m.bridge_d_t + w_q / m.bridge_q_t) + w_s
    i_a += c * i_d - s * i_q
    i_b += s * i_d + c * i_q
    cogging = m.cogging * math.sin(m.teeth * theta)
    # W of the cogging is m.cogging cos(teeth theta) / teeth, per turn of the shaft
    energy = 1.5 * energy + m.cogging * math.cos(m.teeth * theta) / m.teeth / m.pole_pairs
    return i_a, i_b, 1.5 * m.pole_pairs * pull + cogging, energy


def linkage(m, psi, i_d, i_q, theta=0.0):
    """Flux linkage (d, q) of a current, by Newton's method; theta: electrical angle."""
    turn = np.exp(1j * theta)

    def current(x):
        i_a, i_b, _, _ = circuit(m, psi, (x * turn).real, (x * turn).imag, theta)
        return complex(i_a, i_b) / turn

    lam = 0.8 * complex(psi + i_d / m.gap_d, i_q / m.gap_q)
    step = 1e-6 * m.rated / m.gap_q
    most = 0.2 * max(psi, m.rated / m.gap_q)  # the knee is steep
    for _ in range(100):
        error = current(lam) - complex(i_d, i_q)
        if abs(error) < 1e-9 * m.rated:
            return lam.real, lam.imag
        by_d, by_q = (current(lam + step) - current(lam)) / step, (current(lam + 1j * step) - current(lam)) / step
        change = np.linalg.solve([[by_d.real, by_q.real], [by_d.imag, by_q.imag]], [error.real, error.imag])
        change *= min(1.0, most / max(float(np.hypot(*change)), 1e-30))
        lam -= complex(*change)
    raise ArithmeticError(f"no flux linkage found for {i_d:.3g}, {i_q:.3g} A")
