# SPDX-License-Identifier: BSD-3-Clause
"""Float field-oriented control on measured signals: PI in dq with decoupling, voltage limit, modulation.

Uses the nominal machine only.  The voltage is rotated to the middle of the period in which it takes effect,
1.5 periods after the sample.
"""

import math

import numba as nb

jit = nb.njit(cache=True, fastmath=False)
ROOT3 = math.sqrt(3.0)


@jit
def to_dq(a, b, c, theta):
    """Amplitude-invariant Clarke, then Park: phase values to d, q."""
    alpha = (2.0 * a - b - c) / 3.0
    beta = (b - c) / ROOT3
    cosine, sine = math.cos(theta), math.sin(theta)
    return cosine * alpha + sine * beta, cosine * beta - sine * alpha


@jit
def control(c, memory, i_abc, theta, omega, u_dc, i_d_ref, i_q_ref, period_s, duties):
    """One step; fills duties (3,), which take effect one period later.  memory (3,): integrators of d, q, speed."""
    i_d, i_q = to_dq(i_abc[0], i_abc[1], i_abc[2], theta)
    e_d, e_q = i_d_ref - i_d, i_q_ref - i_q
    u_d = c.kp_d * e_d + memory[0] - c.decouple * omega * c.l_q * i_q_ref
    u_q = c.kp_q * e_q + memory[1] + c.decouple * omega * (c.l_d * i_d_ref + c.psi_m)
    most = c.limit * u_dc * (1.0 / ROOT3 if c.svm else 0.5)
    length = math.hypot(u_d, u_q)
    if length > most:
        u_d, u_q = u_d * most / length, u_q * most / length
    else:
        memory[0] += c.ki_d * period_s * e_d
        memory[1] += c.ki_q * period_s * e_q
    ahead = theta + 1.5 * period_s * omega
    cosine, sine = math.cos(ahead), math.sin(ahead)
    alpha, beta = cosine * u_d - sine * u_q, sine * u_d + cosine * u_q
    u_a, u_b = alpha, -0.5 * alpha + 0.5 * ROOT3 * beta
    u_c = -u_a - u_b
    common = 0.5 * (max(u_a, u_b, u_c) + min(u_a, u_b, u_c)) if c.svm else 0.0
    for x in range(3):
        u = u_a if x == 0 else u_b if x == 1 else u_c
        d = min(max(0.5 + (u - common) / u_dc, c.duty_min), 1.0 - c.duty_min)
        duties[x] = math.floor(d / c.duty_lsb + 0.5) * c.duty_lsb


@jit
def speed_control(c, memory, omega_ref, omega, period_s):
    """i_q reference [A] of the speed loop; electrical speeds [rad/s]."""
    e = omega_ref - omega
    i = c.kp_w * e + memory[2]
    if abs(i) > c.i_limit:
        return math.copysign(c.i_limit, i)
    memory[2] += c.ki_w * period_s * e
    return i
