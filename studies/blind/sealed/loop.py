# SPDX-License-Identifier: BSD-3-Clause
"""The closed loop, one control period after the other.

In the period that begins at row k the duties of row k - 1 are in force.  Angle and bus belong to the beginning of
the period, the currents too unless the converters are skewed.

The compiled run() in __pycache__ does not see changes of the files that it calls: delete the folder after one.
"""

import math

import numba as nb
import numpy as np

from studies.blind.sealed import inverter as inv
from studies.blind.sealed.control import ANGLE, MEMORY, SPEED, current_regulator, modulate, speed_regulator, track_speed
from studies.blind.sealed.machine import drag, phases, substep, turn, vector
from studies.blind.sealed.magnetics import torque
from studies.blind.sealed.sensors import anti_alias, bus_code, current_codes, shaft_code, wrap

jit = nb.njit(cache=True)
ROWS = ("t", "i_a", "i_b", "i_c", "theta_e", "omega_e", "u_dc", "d_a", "d_b", "d_c", "i_d_ref", "i_q_ref",
        "torque", "temp_winding")  # fmt: skip
# Means over the period in true rotor axes, then energies [J] since the start, for checks of the simulation.
INSIDE = ("u_d", "u_q", "i_d", "i_q", "psi_d", "psi_q", "omega_e", "e_in", "e_copper", "e_shaft", "e_iron", "e_bus")


@jit
def run(m, v, s, c, goal, i_ref, load, fan, free, theta0, noise):
    """(rows, inside) of a recording.

    goal (n + 1,): mechanical speed at the periods' beginnings [rad/s], imposed unless free; i_ref (n,): complex [A];
    load (n,): torque on the shaft [Nm], to which fan * speed^2 is added; noise (n, 5): of unit variance.
    """
    n, period, p = len(i_ref), v.period, m.pole_pairs
    rows, inside = np.zeros((n, 14)), np.zeros((n, 12))
    up, down, times = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(v.steps + 40)
    queue = np.full((5, 3), 0.5)  # duties; row 0: the latest
    node, i_abc, seen, sampled, held = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    i_end = np.zeros(3)
    legs, share = np.zeros(3), np.zeros(3)
    measured, duties, memory, tracking = np.zeros(3), np.zeros(3), np.zeros(MEMORY), np.zeros(2)
    theta, omega, temp, i_fe, i_short, i_dq, pull = theta0, goal[0], 25.0, 0j, 0.0, 0j, 0.0
    psi = m.psi * turn(p * theta)
    bus = bus_seen = v.u_source
    tracking[0], tracking[1] = theta, omega
    memory[ANGLE], memory[SPEED] = p * theta, p * omega
    energy = np.zeros(5)
    for k in range(n):
        now = k * period
        psi_m = m.psi * (1.0 - m.magnet_drop * (1.0 - math.exp(-now / m.tau_magnet)))
        r = m.r * (1.0 + 0.00393 * (temp - 25.0))
        slope = (goal[k + 1] - goal[k]) / period
        if not free:
            omega = goal[k]
        drawn = load[k] + fan * omega * abs(omega)
        pull = torque(m, psi_m, psi * turn(p * theta).conjugate(), i_dq, p * theta)
        mechanical = shaft_code(s, period, theta, pull, noise[k, 3], tracking)
        theta_e = wrap(p * mechanical + s.angle)
        u_dc = bus_code(s, bus_seen, noise[k, 4])
        rows[k, 12] = drawn if free else pull - drag(m, theta, omega) - m.inertia * slope
        rows[k, 13] = temp
        # the carrier periods that reach into this control period
        e = v.extra
        inv.pulses(v, queue[1 + e], queue[2 + e], v.late - period, up[0], down[0])
        inv.pulses(v, queue[e], queue[1 + e], v.late, up[1], down[1])
        count = inv.instants(v, up, down, s.skew if s.skew > 0.0 else period + s.skew, times)
        wait = s.skew
        u_sum, i_sum, psi_sum = 0j, 0j, 0j
        for j in range(count):
            z = i_dq * turn(p * theta) + i_fe + 2.0 / 3.0 * m.short_share * i_short
            phases(z, i_abc)
            h = (times[j + 1] if j + 1 < count else period) - times[j]
            if s.tau == 0.0:
                seen[:] = i_abc
            if s.skew >= 0.0 and abs(times[j] - wait) < 1e-13:
                sampled[:] = seen
            if s.skew < 0.0 and j == 0:
                current_codes(s, sampled, held, noise[k], measured)
            if s.skew < 0.0 and abs(times[j] - period - wait) < 1e-13:
                sampled[:] = seen
            if h < 1e-13:
                continue
            middle = times[j] + 0.5 * h
            for x in range(3):
                what = inv.state(middle, up, down, v.dead, x)
                mean, node[x] = inv.leg(v, what, node[x], bus, i_abc[x], h)
                share[x] = mean / bus
                legs[x] = mean - inv.drop(v, i_abc[x])
            u = vector(legs[0], legs[1], legs[2])
            rotor = turn(p * (theta + 0.5 * h * omega)).conjugate()
            before, psi_before = i_dq, psi
            psi, i_fe, i_short, theta, omega, i_dq, pull = substep(
                m, r, psi_m, u, h, slope, free, drawn, psi, i_fe, i_short, theta, omega, i_dq
            )
            if s.tau > 0.0:
                z = i_dq * turn(p * theta) + i_fe + 2.0 / 3.0 * m.short_share * i_short
                phases(z, i_end)
                anti_alias(s.tau, h, i_abc, i_end, seen)
            i_mid = 0.5 * (before + i_dq) * rotor.conjugate()
            total = i_mid + i_fe + 2.0 / 3.0 * m.short_share * i_short
            phases(total, i_abc)
            copper = 1.5 * r * abs(total) ** 2
            drawn_dc = share[0] * i_abc[0] + share[1] * i_abc[1] + share[2] * i_abc[2]
            for x in range(3):
                copper += m.r_phase[x] * i_abc[x] ** 2
            bus_before = bus
            bus += h / v.c_bus * ((inv.source(v, now + middle) - bus) / v.r_source - drawn_dc)
            bus_seen = bus + (bus_seen - bus) * math.exp(-h / s.bus_tau) if s.bus_tau > 0.0 else bus
            temp += h * (m.heat * copper - (temp - 25.0) / m.tau_heat)
            energy[0] += 1.5 * h * (u * total.conjugate()).real
            energy[1] += h * copper
            energy[2] += h * pull * omega
            energy[3] += 1.5 * ((psi - psi_before) * i_fe.conjugate()).real
            energy[4] += h * drawn_dc * bus_before
            u_sum += h * u * rotor
            i_sum += h * total * rotor
            psi_sum += 0.5 * h * (psi_before + psi) * rotor
        if s.skew >= 0.0:
            current_codes(s, sampled, held, noise[k], measured)
        for x in range(3):
            rows[k, 1 + x] = measured[x]
        inside[k, 0], inside[k, 1] = u_sum.real / period, u_sum.imag / period
        inside[k, 2], inside[k, 3] = i_sum.real / period, i_sum.imag / period
        inside[k, 4], inside[k, 5] = psi_sum.real / period, psi_sum.imag / period
        inside[k, 6] = p * omega
        inside[k, 7:12] = energy
        # the controller
        i = vector(measured[0], measured[1], measured[2]) * turn(theta_e).conjugate()
        omega_e = track_speed(c, theta_e, memory)
        wanted = speed_regulator(c, p * goal[k], omega_e, memory) if c.speed_loop else i_ref[k]
        u_ref = current_regulator(c, wanted, i, omega_e, u_dc, memory)
        modulate(c, u_ref, theta_e + 1.5 * omega_e * period, u_dc, duties)
        for row in range(4, 0, -1):
            queue[row] = queue[row - 1]
        queue[0] = duties
        rows[k, 0], rows[k, 4], rows[k, 5], rows[k, 6] = now, theta_e, omega_e, u_dc
        rows[k, 7:10] = duties
        rows[k, 10], rows[k, 11] = wanted.real, wanted.imag
    return rows, inside
