# SPDX-License-Identifier: BSD-3-Clause
"""What converters and encoder make of the truth, as codes."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def current(s, i, gain, offset, noise, t):
    """Code of a current converter, full scale 2^(bits-1) at range_a."""
    half = 1 << (s.bits - 1)
    seen = gain * i + offset + s.noise_a * noise + s.hum * math.sin(2.0 * math.pi * 50.0 * t)
    return max(-half, min(half - 1, int(math.floor(seen / s.range_a * half + 0.5))))


@njit(cache=True)
def bus(s, u, noise):
    """Code of the bus converter, 12 bits."""
    return int(math.floor((s.bus_gain * u + s.noise_v * noise) / s.range_v * 4096.0 + 0.5))


@njit(cache=True)
def encoder(s, theta_m):
    """Code of the encoder, not wrapped: an eccentric disc, and tracks of unequal gain as a resolver has them."""
    bent = theta_m + s.runout * math.cos(theta_m + s.runout_phase) + s.resolver * math.sin(2.0 * theta_m)
    return int(math.floor(bent / (2.0 * math.pi) * (1 << s.encoder_bits)))
