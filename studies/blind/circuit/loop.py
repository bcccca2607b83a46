# SPDX-License-Identifier: BSD-3-Clause
"""The control periods one after the other: sample at the valley, regulate for the next period, integrate this one."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from studies.blind.circuit import control, inverter, sensors
from studies.blind.circuit.machine import (
    BUS,
    E_COPPER,
    E_CORE,
    HALF3,
    LAM_A,
    LAM_B,
    LOAD,
    SPEED,
    STATES,
    THETA,
    currents,
    resistances,
    slopes,
)  # fmt: skip

TWO_PI = 2.0 * math.pi
# of a row, as integers: currents, encoder, bus, speed, three on-times, temperature in half degrees
CODES = 10
# of the inside: currents d, q, flux d, q, energy of the field, temperatures, torque at the shaft, then the state
INSIDE = 9 + STATES


@njit(cache=True)
def runge_kutta(m, v, bench, psi, r, level, goal, t, h, y, work):
    """One step of fourth order."""
    k1, k2, k3, k4, z = work[0], work[1], work[2], work[3], work[4]
    slopes(m, v, bench, psi, r, level, goal, t, y, k1)
    for n in range(STATES):
        z[n] = y[n] + 0.5 * h * k1[n]
    slopes(m, v, bench, psi, r, level, goal, t + 0.5 * h, z, k2)
    for n in range(STATES):
        z[n] = y[n] + 0.5 * h * k2[n]
    slopes(m, v, bench, psi, r, level, goal, t + 0.5 * h, z, k3)
    for n in range(STATES):
        z[n] = y[n] + h * k3[n]
    slopes(m, v, bench, psi, r, level, goal, t + h, z, k4)
    for n in range(STATES):
        y[n] += h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n])


@njit(cache=True)
def phases_of(a, b):
    return a, -0.5 * a + HALF3 * b, -0.5 * a - HALF3 * b


@njit(cache=True)
def period(m, v, bench, psi, r, duty, level, due, goal, start, steps, y, work):
    """Integrate one period.  level: of the legs; due[leg]: instant and level of an edge to come, inf if none."""
    stop, t = start + v.period, start
    late = (v.late_a, v.late_b, v.late_c)
    rise, fall = np.empty(3), np.empty(3)
    for k in range(3):
        rise[k], fall[k] = start + 0.5 * v.period * (1.0 - duty[k]), start + 0.5 * v.period * (1.0 + duty[k])
    longest = v.period / steps
    while t < stop - 1e-13:
        end = min(stop, t + longest)
        for k in range(3):
            for x in (rise[k], fall[k], due[k, 0]):
                end = min(end, max(x, t))
        if end > t:
            runge_kutta(m, v, bench, psi, r, level, goal, t, end - t, y, work)
        t = end
        for k in range(3):
            if due[k, 0] <= t:
                level[k], due[k, 0] = due[k, 1], np.inf
            commanded = rise[k] <= t or fall[k] <= t
            if commanded:
                rises = rise[k] <= t
                a, b, _, _, _, _ = currents(m, psi, y)
                i = phases_of(a, b)[k]
                # an edge that is still to come at the opposite command is taken at once
                if due[k, 0] < np.inf:
                    level[k] = due[k, 1]
                due[k, 0] = t + inverter.edge(v, rises, y[BUS], i, late[k])
                due[k, 1] = 1.0 if rises else 0.0
                if rises:
                    rise[k] = np.inf
                else:
                    fall[k] = np.inf


@njit(cache=True)
def warm_up(heat, hot, copper, core, h):
    """Temperatures [degC] of winding, iron and magnets after the losses [J] of a step of h."""
    winding, iron, magnet = hot[0], hot[1], hot[2]
    out = heat.k_winding * (winding - iron) * h
    across = heat.k_magnet * (magnet - iron) * h
    hot[0] += (copper - out) / heat.c_winding
    hot[1] += ((1.0 - heat.magnet_share) * core + out + across - heat.k_ambient * (iron - 25.0) * h) / heat.c_iron
    hot[2] += (heat.magnet_share * core + heat.magnet_w * h - across) / heat.c_magnet


@njit(cache=True)
def run(m, heat, v, s, k, bench, speeds, goals, noise, steps, table, y, hot):
    """All periods; returns (codes, inside).  speeds [rad/s of the shaft], goals: references as integers."""
    count = len(speeds)
    codes, inside = np.zeros((count, CODES), dtype=np.int64), np.zeros((count, INSIDE))
    level, due, work = np.zeros(3), np.full((3, 2), np.inf), np.zeros((5, STATES))
    ticks, duty = np.full(3, k.ticks // 2), np.full(3, 0.5)
    acc, i_codes = np.zeros(2, dtype=np.int64), np.zeros(3, dtype=np.int64)
    gains, offsets = (s.gain_a, s.gain_b, s.gain_c), (s.offset_a, s.offset_b, s.offset_c)
    up, before, speed, message, told = 16 - s.bits, 0, 0, 0, 0
    buses = np.zeros(count, dtype=np.int64)
    for n in range(count):
        t = n * v.period
        psi = m.psi * (1.0 + heat.beta * (hot[2] - 25.0))
        r = resistances(m, hot[0], heat.alpha, t)
        a, b, _, _, _, energy = currents(m, psi, y)
        phases = phases_of(a, b)
        for leg in range(3):
            i_codes[leg] = sensors.current(s, phases[leg], gains[leg], offsets[leg], noise[n, leg], t)
        place = sensors.encoder(s, y[THETA] / m.pole_pairs - s.angle_late * y[SPEED])
        buses[n] = sensors.bus(s, y[BUS], noise[n, 3])
        if n % s.bus_every == 0:
            message = buses[max(0, n - s.bus_late)]
        if n % s.speed_every == 0:
            speed = place - before if n else int(speeds[0] * v.period * s.speed_every / TWO_PI * (1 << s.encoder_bits))
            before = place
        if n % 1000 == 0:
            told = int(math.floor(hot[0] * 2.0 + 0.5))
        angle = ((place * m.pole_pairs) << 16 >> s.encoder_bits) + int(s.angle / TWO_PI * 65536.0)
        ahead = ((speed * m.pole_pairs * 3) << 15 >> s.encoder_bits) // s.speed_every
        row = codes[n]
        for leg in range(3):
            row[leg] = i_codes[leg]
            i_codes[leg] = i_codes[leg] << up
            duty[leg] = ticks[leg] / k.ticks  # computed a period ago, in effect now
        row[3], row[4], row[5] = place, message, speed
        control.regulate(k, i_codes, angle, ahead, speed, goals[n], message << 3, acc, table, ticks)
        for leg in range(3):
            row[6 + leg] = ticks[leg]
        row[9] = told
        c, sn = math.cos(y[THETA]), math.sin(y[THETA])
        seen = inside[n]
        seen[0], seen[1] = c * a + sn * b, c * b - sn * a
        seen[2], seen[3] = c * y[LAM_A] + sn * y[LAM_B], c * y[LAM_B] - sn * y[LAM_A]
        seen[4], seen[5], seen[6], seen[7] = energy, hot[0], hot[1], hot[2]
        seen[9:] = y
        copper, core, omega = y[E_COPPER], y[E_CORE], y[SPEED]
        period(m, v, bench, psi, r, duty, level, due, speeds[n], t, steps, y, work)
        inside[n, 8] = (bench.kp * (y[SPEED] - speeds[n]) + y[LOAD]) + bench.inertia * (y[SPEED] - omega) / v.period
        warm_up(heat, hot, y[E_COPPER] - copper, y[E_CORE] - core, v.period)
    return codes, inside
