# SPDX-License-Identifier: BSD-3-Clause
"""Flux linkage of the synthetic machines and its inverse.

All of it comes from one co-energy W(i_d, i_q) = S_d(i_d) + S_q(i_q) + C(i_d, i_q), so that
d psi_d / d i_q = d psi_q / d i_d holds in every form.  The magnet flux and its angle harmonics are added by
the caller.
"""

import math

import numba as nb

from studies.blind import params as P

jit = nb.njit(cache=True, fastmath=False)


@jit
def self_flux(kind, inductance, s, shift, i):
    """Flux [Wb] of an axis' own current [A] and its slope [H]; the slope at i = 0 is ``inductance``."""
    if kind == P.SELF_LINEAR:
        return inductance * i, inductance
    if kind == P.SELF_CUBIC:  # s in 1/A2; goes on with a third of the inductance behind the valid range
        if s > 0.0 and 3.0 * s * i * i > 0.67:
            edge = math.sqrt(0.67 / (3.0 * s))
            at = inductance * edge * (1.0 - s * edge * edge)
            return math.copysign(at + 0.33 * inductance * (abs(i) - edge), i), 0.33 * inductance
        return inductance * i * (1.0 - s * i * i), inductance * (1.0 - 3.0 * s * i * i)
    x = i / s
    if kind == P.SELF_TANH:
        y = math.tanh(x)
        return inductance * s * y, inductance * (1.0 - y * y)
    if kind == P.SELF_RATIONAL:
        y = 1.0 + abs(x)
        return inductance * i / y, inductance / (y * y)
    if kind == P.SELF_LANGEVIN:
        if abs(x) < 1e-2:
            return inductance * i * (1.0 - x * x / 15.0), inductance * (1.0 - x * x / 5.0)
        coth = 1.0 / math.tanh(x)
        return 3.0 * inductance * s * (coth - 1.0 / x), 3.0 * inductance * (1.0 - coth * coth + 1.0 / (x * x))
    if kind == P.SELF_ROOT:
        y = math.sqrt(1.0 + x * x)
        return inductance * i / y, inductance / (y * y * y)
    y0 = math.tanh(shift / s)  # SELF_SHIFTED: the magnet has already driven the iron to ``shift``
    y = math.tanh((i + shift) / s)
    scale = inductance / (1.0 - y0 * y0)
    return scale * s * (y - y0), scale * (1.0 - y * y)


@jit
def cross_flux(kind, c, i_x, i_d, i_q):
    """What C adds: psi_d, psi_q [Wb], then d psi_d/d i_d, d psi_d/d i_q, d psi_q/d i_q [H]."""
    if kind == P.CROSS_NONE:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    if kind == P.CROSS_SQUARE:  # C = c i_d i_q^2
        return c * i_q * i_q, 2.0 * c * i_d * i_q, 0.0, 2.0 * c * i_q, 2.0 * c * i_d
    if kind == P.CROSS_MODULUS:  # C = c i_d (sqrt(i_q^2 + i_x^2) - i_x)
        root = math.sqrt(i_q * i_q + i_x * i_x)
        slope, bend = i_q / root, i_x * i_x / (root * root * root)
        return c * (root - i_x), c * i_d * slope, 0.0, c * slope, c * i_d * bend
    v = 1.0 + (i_q / i_x) ** 2
    g, g1 = i_q * i_q / v, 2.0 * i_q / (v * v)
    g2 = 2.0 / (v * v) - 8.0 * (i_q / i_x) ** 2 / (v * v * v)
    if kind == P.CROSS_LEVELLING:  # C = c i_d g(i_q)
        return c * g, c * i_d * g1, 0.0, c * g1, c * i_d * g2
    y = math.tanh(i_d / i_x)  # CROSS_BOTH_LEVEL: C = c i_x tanh(i_d / i_x) g(i_q)
    y1 = 1.0 - y * y
    return c * y1 * g, c * i_x * y * g1, -2.0 * c * y * y1 / i_x * g, c * y1 * g1, c * i_x * y * g2


@jit
def flux(m, i_d, i_q):
    """psi_d, psi_q [Wb] without magnet, and d psi_d/d i_d, d psi_d/d i_q, d psi_q/d i_q [H]."""
    f_d, l_dd = self_flux(m.self_d, m.l_d, m.sat_d, m.shift_d, i_d)
    f_q, l_qq = self_flux(m.self_q, m.l_q, m.sat_q, 0.0, i_q)
    x_d, x_q, x_dd, x_dq, x_qq = cross_flux(m.cross, m.c_x, m.i_x, i_d, i_q)
    return f_d + x_d, f_q + x_q, l_dd + x_dd, x_dq, l_qq + x_qq


@jit
def current(m, psi_d, psi_q, guess_d, guess_q):
    """i_d, i_q [A] of a flux linkage without magnet [Wb]; Newton from the guess, to 1e-13 of the flux."""
    if m.self_d == P.SELF_LINEAR and m.self_q == P.SELF_LINEAR and m.cross == P.CROSS_NONE:
        return psi_d / m.l_d, psi_q / m.l_q
    i_d, i_q = guess_d, guess_q
    small = 1e-13 * (m.psi_m + abs(psi_d) + abs(psi_q))
    for _ in range(30):
        f_d, f_q, dd, dq, qq = flux(m, i_d, i_q)
        e_d, e_q = psi_d - f_d, psi_q - f_q
        if abs(e_d) + abs(e_q) < small:
            break
        det = dd * qq - dq * dq
        i_d += (qq * e_d - dq * e_q) / det
        i_q += (dd * e_q - dq * e_d) / det
    return i_d, i_q


@jit
def harmonics(m, theta):
    """Angle harmonics of the magnet flux in dq [Wb] and their slope [Wb/rad] at the electrical angle."""
    h_d, h_q, s_d, s_q = 0.0, 0.0, 0.0, 0.0
    for k in range(m.psi_h.shape[0]):
        order = m.psi_h[k, 0]
        x, y = order * theta + m.psi_h[k, 2], order * theta + m.psi_h[k, 4]
        h_d += m.psi_h[k, 1] * math.cos(x)
        s_d -= order * m.psi_h[k, 1] * math.sin(x)
        h_q += m.psi_h[k, 3] * math.cos(y)
        s_q -= order * m.psi_h[k, 3] * math.sin(y)
    return h_d, h_q, s_d, s_q
