# SPDX-License-Identifier: BSD-3-Clause
"""Sensors: measured currents, angle, speed and bus voltage for controller and recording."""

import math

import numba as nb

from studies.blind import params as P

jit = nb.njit(cache=True, fastmath=False)
ROOT3 = math.sqrt(3.0)


@jit
def rounded(x, lsb):
    """Quantised to steps of lsb (0: not at all)."""
    return math.floor(x / lsb + 0.5) * lsb if lsb > 0.0 else x


@jit
def phase_current(s, gain, offset, noise, i, neighbour):
    """One sensor's reading [A]; neighbour: cross-talk from the other conductors [A]."""
    x = i + s.cross_talk * neighbour
    x = x * (1.0 + s.quadratic * x + s.cubic * x * x)
    x = x * (1.0 + s.scale) * (1.0 + gain) + offset + s.noise_a * noise
    return rounded(min(max(x, -s.range_a), s.range_a), s.lsb_a)


@jit
def measure_currents(s, i, offsets, noise, out):
    """Fills out (3,) from true phase currents i (3,), offsets (3,), standard normal noise (3,)."""
    out[0] = phase_current(s, s.gain_a, offsets[0], noise[0], i[0], (i[1] - i[2]) / ROOT3)
    out[1] = phase_current(s, s.gain_b, offsets[1], noise[1], i[1], (i[2] - i[0]) / ROOT3)
    out[2] = phase_current(s, s.gain_c, offsets[2], noise[2], i[2], (i[0] - i[1]) / ROOT3)
    if s.two_sensors:
        out[2] = -out[0] - out[1]


@jit
def wave(kind, x):
    """Waveform of period 2 pi and amplitude 1: cosine, triangle, or a skewed cosine."""
    if kind == P.WAVE_COSINE:
        return math.cos(x)
    if kind == P.WAVE_TRIANGLE:
        return 2.0 / math.pi * math.asin(math.cos(x))
    return math.cos(x + 0.5 * math.cos(x))


@jit
def measure_angle(s, theta_m, pole_pairs, offset, noise):
    """Electrical angle [rad], not wrapped, of an encoder with ``offset`` [rad] electrical."""
    error = offset + s.ecc_1 * wave(s.ecc_1_wave, theta_m + s.ecc_1_phase)
    error += s.ecc_2 * math.cos(2.0 * theta_m + s.ecc_2_phase) + s.ecc_n * math.cos(s.ecc_order * theta_m)
    return rounded(pole_pairs * theta_m + error + s.theta_noise * noise, s.theta_lsb)
