# SPDX-License-Identifier: BSD-3-Clause
"""Current converters, encoder or resolver with tracking loop, bus sensor."""

import math

import numba as nb

from studies.blind.sealed.params import RESOLVER

jit = nb.njit(cache=True)


@jit
def wrap(x):
    """Angle in -pi to pi."""
    return (x + math.pi) % (2.0 * math.pi) - math.pi


@jit
def anti_alias(tau, h, start, end, seen):
    """Low-passed currents ``seen`` (3,) after h seconds in which the currents went from ``start`` to ``end`` [A].

    Exact for a current that is linear in time: a substep may be longer than tau.
    """
    keep = math.exp(-h / tau)
    for x in range(3):
        lag = (end[x] - start[x]) / h * tau
        seen[x] = end[x] - lag + (seen[x] - start[x] + lag) * keep


@jit
def current_codes(s, seen, held, noise, out):
    """Write three measured currents [A].

    seen (3,): at the converters' inputs [A]; held (3,): memory of the hysteresis [A]; noise (3,): of unit variance.
    """
    for x in range(3):
        i = seen[x] + s.talk * seen[(x + 1) % 3]
        if s.play > 0.0:
            held[x] = min(max(held[x], i - s.play), i + s.play)
            i = held[x]
        y = i / s.range_a
        i *= 1.0 - s.bend * y * y
        i = s.gain[x] * i + s.offset[x] + s.noise * noise[x]
        i = min(max(i, -s.range_a), s.range_a)
        out[x] = math.floor(i / s.lsb + 0.5) * s.lsb


@jit
def shaft_code(s, period, theta, torque, noise, loop):
    """Mechanical angle [rad] of the encoder's code or of the resolver's tracking loop; loop: angle and speed of it."""
    bent = theta + s.twist * torque
    if s.runout != 0.0:
        bent += s.runout * math.cos(theta + s.runout_phase)
    bent += s.angle_noise * noise
    if s.kind == RESOLVER:
        a = s.track * period
        loop[0] += period * loop[1]
        error = bent - loop[0]
        loop[0] += 1.4 * a / (1.0 + 1.4 * a) * error
        loop[1] += a * a / (1.0 + 1.4 * a) / period * error
        bent = loop[0]
    return math.floor(bent / s.angle_lsb + 0.5) * s.angle_lsb


@jit
def bus_code(s, held, noise):
    """Measured bus voltage [V] from the sensor's low-passed one."""
    return math.floor((s.bus_gain * held + s.bus_noise * noise) / s.bus_lsb + 0.5) * s.bus_lsb
