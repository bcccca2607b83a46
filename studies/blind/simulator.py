# SPDX-License-Identifier: BSD-3-Clause
"""Switching-level simulation of a drive with field-oriented control; the benchmark's own physics.

State: stator flux linkage in the stator frame, speed, angle.  d psi/dt = C(v_leg - R_x i_x), with the legs'
voltages constant in kind between switching instants; currents follow from the flux (magnetics.py).  Iron loss
is a resistance across the rotational EMF: i_terminal = i + j omega psi / R_fe.  Each interval is integrated
with the midpoint rule, in more steps where a leg commutates, because its voltage then follows the current.

Period k: angle at the valley t_k, currents at t_k + skew, duties from them in force in [t_{k+1}, t_{k+2}].
"""

import math

import numba as nb
import numpy as np

from studies.blind import params as P
from studies.blind.bridge import DEAD, leg_state, leg_voltage, pulse
from studies.blind.foc import control, speed_control
from studies.blind.magnetics import current, harmonics
from studies.blind.sensing import measure_angle, measure_currents, rounded

jit = nb.njit(cache=True, fastmath=False)
ROOT3 = math.sqrt(3.0)
TWO_PI = 2.0 * math.pi
ROWS = (
    "i_a",
    "i_b",
    "i_c",
    "theta_e",
    "omega_e",
    "u_dc",
    "d_a",
    "d_b",
    "d_c",
    "i_d_ref",
    "i_q_ref",
    "torque",
)
TRACE = (
    "i_alpha",
    "i_beta",
    "psi_alpha",
    "psi_beta",
    "theta_true",
    "omega_true",
    "u_mean_alpha",
    "u_mean_beta",
    "i_mean_alpha",
    "i_mean_beta",
    "torque_em",
    "work_in",
    "work_out",
)
# Working state: flux, speed, angle, then what follows from them.
PA, PB, OM, TH, GD, GQ, IA, IB, TQ = range(9)


@jit
def settle(m, s, psi_scale):
    """Fill currents and air-gap torque of the state from flux, speed and angle."""
    theta, omega = m.pole_pairs * s[TH], m.pole_pairs * s[OM]
    cosine, sine = math.cos(theta), math.sin(theta)
    psi_d, psi_q = cosine * s[PA] + sine * s[PB], cosine * s[PB] - sine * s[PA]
    h_d, h_q, s_d, s_q = harmonics(m, theta)
    s[GD], s[GQ] = current(m, psi_d - psi_scale * (m.psi_m + h_d), psi_q - psi_scale * h_q, s[GD], s[GQ])
    s[IA], s[IB] = cosine * s[GD] - sine * s[GQ], sine * s[GD] + cosine * s[GQ]
    pull = psi_d * s[GQ] - psi_q * s[GD] + psi_scale * (s_d * s[GD] + s_q * s[GQ])
    s[TQ] = 1.5 * m.pole_pairs * pull
    g = m.g_eddy + m.g_hyst * m.w_hyst / math.sqrt(omega * omega + 1e-4 * m.w_hyst * m.w_hyst)
    s[IA] -= omega * s[PB] * (g + m.g_short)
    s[IB] += omega * s[PA] * g


@jit
def shaft_torque(h, omega, theta):
    """Torque [Nm] of cogging and unbalance less friction, at the mechanical speed and angle."""
    direction = math.tanh(omega / h.w_sign)
    t = -h.viscous * omega - direction * (h.coulomb + h.stribeck * math.exp(-((omega / h.w_stribeck) ** 2)))
    for k in range(h.cogging.shape[0]):
        t += h.cogging[k, 1] * math.sin(h.cogging[k, 0] * theta + h.cogging[k, 2])
    return t + h.unbalance * math.sin(theta)


@jit
def rates(drive, s, legs, u_dc, r_scale, load, slope, out):
    """Fills out: d psi_alpha, d psi_beta [V], d omega [rad/s2], then the terminal voltage alpha, beta [V]."""
    m, b = drive.motor, drive.bridge
    i_a, i_b = s[IA], -0.5 * s[IA] + 0.5 * ROOT3 * s[IB]
    i_c = -i_a - i_b
    v_a, v_b = leg_voltage(b, legs[0], u_dc, i_a), leg_voltage(b, legs[1], u_dc, i_b)
    v_c = leg_voltage(b, legs[2], u_dc, i_c)
    e_a, e_b = v_a - r_scale[0] * m.r_a * i_a, v_b - r_scale[1] * m.r_b * i_b
    e_c = v_c - r_scale[2] * m.r_c * i_c
    out[0], out[1] = (2.0 * e_a - e_b - e_c) / 3.0, (e_b - e_c) / ROOT3
    out[3], out[4] = (2.0 * v_a - v_b - v_c) / 3.0, (v_b - v_c) / ROOT3
    out[2] = slope
    if drive.shaft.free:
        out[2] = (s[TQ] + shaft_torque(drive.shaft, s[OM], s[TH]) - load) / drive.shaft.inertia


@jit
def advance(drive, s, mid, legs, length, steps, u_dc, r_scale, psi_scale, load, slope, k1, k2, mean):
    """Midpoint rule over an interval of constant legs; mean collects u dt, i dt, work in and shaft work."""
    h = length / steps
    for _ in range(steps):
        rates(drive, s, legs, u_dc, r_scale, load, slope, k1)
        mid[:] = s
        mid[PA] += 0.5 * h * k1[0]
        mid[PB] += 0.5 * h * k1[1]
        mid[TH] += 0.5 * h * s[OM]
        mid[OM] += 0.5 * h * k1[2]
        settle(drive.motor, mid, psi_scale)
        rates(drive, mid, legs, u_dc, r_scale, load, slope, k2)
        s[PA] += h * k2[0]
        s[PB] += h * k2[1]
        s[TH] += h * mid[OM]
        s[OM] += h * k2[2]
        s[GD], s[GQ] = mid[GD], mid[GQ]
        settle(drive.motor, s, psi_scale)
        mean[0] += h * k2[3]
        mean[1] += h * k2[4]
        mean[2] += h * mid[IA]
        mean[3] += h * mid[IB]
        mean[4] += h * 1.5 * (k2[3] * mid[IA] + k2[4] * mid[IB])
        mean[5] += h * mid[TQ] * mid[OM]


@jit
def collect(edges, count, t1, t2, shift, dead_s, period_s):
    """Append the instants of three pulses, shifted, that lie within the period; the new count."""
    for x in range(3):
        for t in (t1[x] + shift, t1[x] + shift + dead_s, t2[x] + shift, t2[x] + shift + dead_s):
            if 0.0 < t < period_s:
                edges[count] = t
                count += 1
    return count


@jit
def run(drive, course, noise, start, duty_start, substeps, rows, trace):
    """Simulate len(rows) periods and fill rows and trace.

    noise: (n, 6) standard normal.  start: (9,) state.  duty_start: (3,) duties in force in the first period.
    """
    m, b, sen, c, T = drive.motor, drive.bridge, drive.sensor, drive.control, drive.period_s
    p = m.pole_pairs
    s, mid, k1, k2 = start.copy(), start.copy(), np.zeros(5), np.zeros(5)
    mean, memory = np.zeros(6), np.zeros(3)
    t1, t2, t1_old, t2_old = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    duties, older = duty_start[:3].copy(), duty_start[:3].copy()
    legs, edges = np.zeros(3, np.int64), np.zeros(32)
    i_true, i_low, i_early, i_meas = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    shift = b.delay * T if b.delay_kind == P.DELAY_SHIFT else 0.0
    settle(m, s, course.psi_scale[0])
    i_early[0], i_early[1] = s[IA], -0.5 * s[IA] + 0.5 * ROOT3 * s[IB]
    i_early[2] = -i_early[0] - i_early[1]
    i_low[:] = i_early
    tracked, tracked_speed = (
        measure_angle(sen, s[TH] + s[OM] * sen.theta_late_s, p, course.theta_offset[0], 0.0),
        p * s[OM],
    )
    angle_old, speed = tracked - tracked_speed * T, tracked_speed
    l_min = min(m.l_d, m.l_q) * (0.3 if m.self_d + m.self_q + m.cross > 0 else 1.0)
    pulse(b, duties, older, T, t1, t2)
    t1_old[:] = t1
    t2_old[:] = t2
    for k in range(rows.shape[0]):
        r_scale, psi_scale = course.r_scale[:, k], course.psi_scale[k]
        u_0 = course.u_dc[k] + course.u_hidden[k]
        u_1 = course.u_dc[k + 1] + course.u_hidden[k + 1]
        load, slope = 0.5 * (course.load[k] + course.load[k + 1]), (course.omega[k + 1] - course.omega[k]) / T
        if not drive.shaft.free:
            s[OM] = course.omega[k]
        settle(m, s, psi_scale)
        raw = measure_angle(sen, s[TH] + s[OM] * sen.theta_late_s, p, course.theta_offset[k], noise[k, 3])
        omega_true, torque = p * s[OM], course.load[k]
        if not drive.shaft.free:
            torque = s[TQ] + shaft_torque(drive.shaft, s[OM], s[TH]) - drive.shaft.inertia * slope
        if k < trace.shape[0]:
            trace[k, 0], trace[k, 1], trace[k, 2], trace[k, 3] = s[IA], s[IB], s[PA], s[PB]
            trace[k, 4], trace[k, 5], trace[k, 10] = p * s[TH], omega_true, s[TQ]
        if sen.skew_s == 0.0:
            i_early[0], i_early[1] = s[IA], -0.5 * s[IA] + 0.5 * ROOT3 * s[IB]
            i_early[2] = -i_early[0] - i_early[1]
            if sen.lowpass_s > 0.0:
                i_early[:] = i_low
        i_true[:] = i_early
        # The period: switching instants in order, and the sampling instant if it is not the valley.
        count = collect(edges, 0, t1, t2, shift, b.dead_s, T)
        if shift > 0.0:
            count = collect(edges, count, t1_old, t2_old, shift - T, b.dead_s, T)
        sample_at = sen.skew_s if sen.skew_s >= 0.0 else T + sen.skew_s
        if sen.skew_s != 0.0:
            edges[count] = sample_at
            count += 1
        edges[count] = T
        count += 1
        edges[:count].sort()
        mean[:] = 0.0
        last = 0.0
        for e in range(count):
            length = edges[e] - last
            if length > 1e-13:
                at = last + 0.5 * length
                dead = False
                for x in range(3):
                    if at >= shift:
                        legs[x] = leg_state(at - shift, t1[x], t2[x], b.dead_s)
                    else:
                        legs[x] = leg_state(at - shift + T, t1_old[x], t2_old[x], b.dead_s)
                    dead = dead or legs[x] == DEAD
                u_dc = u_0 + (u_1 - u_0) * at / T
                steps = 1 + int(length / (0.125 * T))
                if dead:
                    steps += int(length * u_dc / (b.i_zone * l_min))
                steps = min(steps, 60) * substeps
                advance(drive, s, mid, legs, length, steps, u_dc, r_scale, psi_scale, load, slope, k1, k2, mean)
                if sen.lowpass_s > 0.0:
                    share = 1.0 - math.exp(-length / sen.lowpass_s)
                    i_b = -0.5 * s[IA] + 0.5 * ROOT3 * s[IB]
                    i_low[0] += share * (s[IA] - i_low[0])
                    i_low[1] += share * (i_b - i_low[1])
                    i_low[2] = -i_low[0] - i_low[1]
            last = edges[e]
            if sen.skew_s != 0.0 and edges[e] == sample_at:
                i_early[0], i_early[1] = s[IA], -0.5 * s[IA] + 0.5 * ROOT3 * s[IB]
                i_early[2] = -i_early[0] - i_early[1]
                if sen.skew_s > 0.0:  # this row's sample; a negative skew belongs to the next row
                    i_true[:] = i_early
        if k < trace.shape[0]:
            for x in range(4):
                trace[k, 6 + x] = mean[x] / T
            trace[k, 11], trace[k, 12] = mean[4], mean[5]
        # Measurement and control.
        measure_currents(sen, i_true, course.offsets[:, k], noise[k, :3], i_meas)
        angle = raw
        if sen.pll_rad_s > 0.0:
            error = raw - tracked
            tracked_speed += T * sen.pll_rad_s**2 * error
            angle = tracked
            tracked += T * (tracked_speed + 2.0 * sen.pll_rad_s * error)
        speed += (1.0 - math.exp(-T * sen.omega_filter_rad_s)) * ((angle - angle_old) / T - speed)
        angle_old = angle
        omega = omega_true if sen.omega_exact else speed
        u_meas = rounded(course.u_dc[k] * (1.0 + sen.u_gain) + sen.u_offset + sen.u_noise * noise[k, 4], sen.u_lsb)
        i_d_ref, i_q_ref = course.i_d_ref[k], course.i_q_ref[k]
        if c.speed_loop:
            i_q_ref = speed_control(c, memory, p * course.omega[k], omega, T)
        older[:] = duties
        t1_old[:] = t1
        t2_old[:] = t2
        rows[k, 0], rows[k, 1], rows[k, 2] = i_meas[0], i_meas[1], i_meas[2]
        rows[k, 3], rows[k, 4], rows[k, 5] = angle % TWO_PI, omega, u_meas
        control(c, memory, i_meas, angle, omega, u_meas, i_d_ref, i_q_ref, T, duties)
        rows[k, 6], rows[k, 7], rows[k, 8] = duties[0], duties[1], duties[2]
        rows[k, 9], rows[k, 10] = i_d_ref, i_q_ref
        rows[k, 11] = torque + sen.torque_noise * noise[k, 5]
        pulse(b, duties, older, T, t1, t2)


def simulate(drive, course, rng, theta_m=0.0, substeps=1, trace=False):
    """Simulate a course; returns {column: (n,)} and, with ``trace``, {true quantity: (n,)} (else None).

    rng: numpy Generator of all noise.  theta_m: mechanical angle at the start [rad].
    The columns are those of ROWS and ``t`` [s]; SI units.
    """
    n = len(course.i_d_ref)
    rows, held = np.zeros((n, len(ROWS))), np.zeros((n if trace else 0, len(TRACE)))
    m, omega = drive.motor, course.omega[0]
    start = np.zeros(9)
    h_d, h_q, _, _ = harmonics(m, m.pole_pairs * theta_m)
    psi = course.psi_scale[0] * (m.psi_m + h_d + 1j * h_q) * np.exp(1j * m.pole_pairs * theta_m)
    start[PA], start[PB], start[OM], start[TH] = psi.real, psi.imag, omega, theta_m
    # The first duties give the no-load voltage, so that the recording does not begin with a transient.
    emf = 1j * m.pole_pairs * omega * psi * np.exp(0.5j * m.pole_pairs * omega * drive.period_s)
    legs = (emf * np.exp(-2j * math.pi / 3.0 * np.arange(3))).real / course.u_dc[0]
    duties = np.clip(0.5 + legs - 0.5 * (legs.max() + legs.min()), 0.02, 0.98)
    run(drive, course, rng.standard_normal((n, 6)), start, duties, substeps, rows, held)
    columns = {"t": np.arange(n) * drive.period_s}
    columns.update((name, rows[:, j]) for j, name in enumerate(ROWS))
    return columns, dict(zip(TRACE, held.T, strict=True)) if trace else None
