# SPDX-License-Identifier: BSD-3-Clause
"""Flux linkages of the rotor's axes from one co-energy, their inverse, and the torque that belongs to them.

W'(i_d, i_q, theta) = self terms + cross term + magnet with harmonics + slotting;  psi = dW'/di,
torque = 3/2 p (psi_d i_q - psi_q i_d + dW'/dtheta).
"""

import math

import numba as nb
import numpy as np

from studies.blind.sealed.params import ARCTAN, LINEAR, ORDERS, TANH

jit = nb.njit(cache=True)


@jit
def unit_curve(curve, x):
    """(value, slope) of a saturating curve with slope 1 at the origin."""
    if curve == ARCTAN:
        y = 0.5 * math.pi * x
        return 2.0 / math.pi * math.atan(y), 1.0 / (1.0 + y * y)
    if curve == TANH:
        y = math.tanh(x)
        return y, 1.0 - y * y
    y = 1.0 / math.sqrt(1.0 + x * x)
    return x * y, y * y * y


@jit
def log_cosh(x):
    """ln cosh x without overflow."""
    a = abs(x)
    return a + math.log1p(math.exp(-2.0 * a)) - 0.6931471805599453


@jit
def turning(m, theta):
    """(flux, slope over the angle) of what turns with multiples of the angle [Wb, Wb/rad]."""
    flux, slope = 0j, 0j
    for k in range(len(ORDERS)):
        if m.harmonic[k] != 0.0:
            n = ORDERS[k]
            z = m.harmonic[k] * complex(math.cos(n * theta), math.sin(n * theta))
            flux += z
            slope += 1j * n * z
    return flux, slope


@jit
def fluxes(m, psi_m, i_d, i_q, theta, magnet):
    """psi_d, psi_q [Wb] and the slopes dd, dq, qq [H]; psi_m: the magnet's; magnet: of turning()."""
    if m.curve == LINEAR:
        d, dd, q, qq = m.l_d * i_d, m.l_d, m.l_q * i_q, m.l_q
    else:
        y, s = unit_curve(m.curve, (i_d + m.bias) / m.knee_d)
        y0, s0 = unit_curve(m.curve, m.bias / m.knee_d)
        soft = m.l_d * (1.0 - m.floor_d) / m.slope
        d = m.floor_d * m.l_d * i_d + soft * m.knee_d * (y - y0)
        dd = m.floor_d * m.l_d + soft * s
        y, s = unit_curve(m.curve, i_q / m.knee_q)
        soft = m.l_q * (1.0 - m.floor_q)
        q = m.floor_q * m.l_q * i_q + soft * m.knee_q * y
        qq = m.floor_q * m.l_q + soft * s
    dq = 0.0
    if m.cross != 0.0:
        x, y = (i_d + m.cross_bias) / m.cross_d, i_q / m.cross_q
        tx, ty, g = math.tanh(x), math.tanh(y), log_cosh(y)
        f = log_cosh(x) - log_cosh(m.cross_bias / m.cross_d)
        ratio = m.cross_d / m.cross_q
        d -= m.cross * tx * g
        q -= m.cross * ratio * ty * f
        dd -= m.cross / m.cross_d * (1.0 - tx * tx) * g
        dq -= m.cross / m.cross_q * tx * ty
        qq -= m.cross * ratio / m.cross_q * (1.0 - ty * ty) * f
    if m.slot != 0.0:
        y = math.tanh(i_q / m.slot_knee)
        a = m.slot * math.cos(6.0 * theta + m.slot_phase)
        q += a * y
        qq += a / m.slot_knee * (1.0 - y * y)
    d += psi_m + magnet.real
    if m.eccentric != 0.0:
        d += psi_m * m.eccentric * math.cos(theta / m.pole_pairs)
    return d, q + magnet.imag, dd, dq, qq


@jit
def currents(m, psi_m, psi, theta, start):
    """i_d + j i_q [A] that belongs to psi [Wb], by Newton's method from ``start``."""
    magnet = turning(m, theta)[0]
    i_d, i_q = start.real, start.imag
    small = 1e-10 * (abs(psi_m) + abs(psi) + 1e-6)
    for _ in range(30):
        d, q, dd, dq, qq = fluxes(m, psi_m, i_d, i_q, theta, magnet)
        e_d, e_q = psi.real - d, psi.imag - q
        if abs(e_d) + abs(e_q) < small:
            break
        det = dd * qq - dq * dq
        i_d += (qq * e_d - dq * e_q) / det
        i_q += (dd * e_q - dq * e_d) / det
    return complex(i_d, i_q)


@jit
def torque(m, psi_m, psi, i, theta):
    """Air-gap torque [Nm]."""
    slope = turning(m, theta)[1]
    pull = psi.real * i.imag - psi.imag * i.real + i.real * slope.real + i.imag * slope.imag
    if m.slot != 0.0:
        pull -= 6.0 * m.slot * m.slot_knee * log_cosh(i.imag / m.slot_knee) * math.sin(6.0 * theta + m.slot_phase)
    if m.eccentric != 0.0:
        pull -= i.real * psi_m * m.eccentric / m.pole_pairs * math.sin(theta / m.pole_pairs)
    return 1.5 * m.pole_pairs * pull


def convex(m, limit, share=0.08):
    """Whether the fluxes are invertible over a square of +-limit [A], with a margin."""
    for d in np.linspace(-limit, limit, 17):
        for q in np.linspace(-limit, limit, 17):
            _, _, dd, dq, qq = fluxes(m, m.psi, d, q, 0.0, 0j)
            if dd < share * m.l_d or qq < share * m.l_q or dd * qq - dq * dq < share * m.l_d * m.l_q:
                return False
    return True
