# SPDX-License-Identifier: BSD-3-Clause
"""Sensors: current and bus-voltage converters, position sensor, seeded noise.

Noise is a hash of (seed, channel, sample number): any sample can be repeated
alone, and an additional sensor does not change the noise of the others.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fluxproof.plant.jit import njit


@dataclass(frozen=True)
class Sensors:
    """Sensor data; every zero error means that it is absent.

    Current: code = 2^(bits-1) + round((i (1 + gain_error) + offset + noise) / lsb),
    lsb = 2 full_scale / 2^bits, clipped to 0..2^bits - 1.
    Bus voltage: code = round((u (1 + gain_error) + offset + noise) / lsb), unsigned.
    Position: the sensed mechanical angle is direction theta_m + offset
    + a1 sin(theta_m + p1) + a2 sin(2 theta_m + p2) + noise, rounded, modulo a turn; with
    position_counts the code is that of the middle of the count the shaft is in.  The code of a resolver with several
    pole pairs runs through its range position_pole_pairs times a turn.
    """

    current_bits: int = 12
    current_full_scale_a: float = 10.0
    current_gain_error: tuple[float, float, float] = (0.0, 0.0, 0.0)
    current_offset_a: tuple[float, float, float] = (0.0, 0.0, 0.0)
    current_noise_a: float = 0.0  # standard deviation
    u_dc_bits: int = 12
    u_dc_full_scale_v: float = 1000.0
    u_dc_gain_error: float = 0.0
    u_dc_offset_v: float = 0.0
    u_dc_noise_v: float = 0.0
    position_bits: int = 12
    position_offset_rad: float = 0.0  # mechanical
    position_direction: int = 1
    eccentricity_once_rad: float = 0.0
    eccentricity_once_phase_rad: float = 0.0
    eccentricity_twice_rad: float = 0.0
    eccentricity_twice_phase_rad: float = 0.0
    position_noise_rad: float = 0.0
    seed: int = 0
    position_counts: int = 0  # of an incremental encoder a turn; 0: the code alone quantises
    position_pole_pairs: int = 1


class SensorParams(NamedTuple):
    """Sensor parameters for the kernels (build with `sensor_params`)."""

    current_bits: int
    current_per_a: float  # codes per ampere
    current_gain: np.ndarray  # (3,)
    current_offset: np.ndarray  # (3,)
    current_noise: float
    u_dc_bits: int
    u_dc_per_v: float
    u_dc_gain: float
    u_dc_offset: float
    u_dc_noise: float
    position_bits: int
    position_offset: float
    direction: float
    once: float
    once_phase: float
    twice: float
    twice_phase: float
    position_noise: float
    seed: int
    position_counts: int
    position_pole_pairs: int


def sensor_params(sensors):
    """Build SensorParams from a Sensors description."""
    s = sensors
    if not all(8 <= bits <= 24 for bits in (s.current_bits, s.u_dc_bits, s.position_bits)):
        raise ValueError("sensor bits must be within 8..24")
    if s.current_full_scale_a <= 0.0 or s.u_dc_full_scale_v <= 0.0 or s.position_direction not in (-1, 1):
        raise ValueError("full scales must be positive, the direction 1 or -1")
    return SensorParams(
        s.current_bits,
        2.0 ** (s.current_bits - 1) / s.current_full_scale_a,
        1.0 + np.asarray(s.current_gain_error, float),
        np.asarray(s.current_offset_a, float),
        float(s.current_noise_a),
        s.u_dc_bits,
        2.0**s.u_dc_bits / s.u_dc_full_scale_v,
        1.0 + s.u_dc_gain_error,
        float(s.u_dc_offset_v),
        float(s.u_dc_noise_v),
        s.position_bits,
        float(s.position_offset_rad),
        float(s.position_direction),
        float(s.eccentricity_once_rad),
        float(s.eccentricity_once_phase_rad),
        float(s.eccentricity_twice_rad),
        float(s.eccentricity_twice_phase_rad),
        float(s.position_noise_rad),
        int(s.seed),
        int(s.position_counts),
        int(s.position_pole_pairs),
    )


@njit
def _uniform(seed, channel, sample, part):
    """Uniform in (0, 1) by the SplitMix64 finaliser (Steele et al., 2014)."""
    x = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(sample)
    for salt in (np.uint64(channel), np.uint64(part)):
        x = (x + np.uint64(0x9E3779B97F4A7C15)) ^ (salt * np.uint64(0xD1B54A32D192ED03))
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x = x ^ (x >> np.uint64(31))
    return (float(x >> np.uint64(11)) + 0.5) * 2.0**-53


@njit
def hash_normal(seed, channel, sample):
    """Standard normal number, a function of its three integer arguments only."""
    radius = math.sqrt(-2.0 * math.log(_uniform(seed, channel, sample, 0)))
    return radius * math.cos(2.0 * math.pi * _uniform(seed, channel, sample, 1))


@njit
def _noise(sigma, seed, channel, sample):
    return sigma * hash_normal(seed, channel, sample) if sigma != 0.0 else 0.0


@njit
def _code(value, bits):
    """Round half up and clip to the converter's range."""
    return min(max(math.floor(value + 0.5), 0), (1 << bits) - 1)


@njit
def current_code(sensors, channel, current, sample):
    """Unsigned code of phase channel 0..2 for a current [A] at a sample number."""
    seen = current * sensors.current_gain[channel] + sensors.current_offset[channel]
    seen += _noise(sensors.current_noise, sensors.seed, channel, sample)
    return _code(seen * sensors.current_per_a + float(1 << (sensors.current_bits - 1)), sensors.current_bits)


@njit
def u_dc_code(sensors, u_dc, sample):
    """Unsigned code of the bus voltage [V] at a sample number."""
    seen = u_dc * sensors.u_dc_gain + sensors.u_dc_offset
    seen += _noise(sensors.u_dc_noise, sensors.seed, 3, sample)
    return _code(seen * sensors.u_dc_per_v, sensors.u_dc_bits)


@njit
def sensed_angle(sensors, theta_m):
    """Where the encoder's disc or the Hall sensors show the shaft [rad], without noise and counts."""
    seen = sensors.direction * theta_m + sensors.position_offset
    if sensors.once != 0.0:
        seen += sensors.once * math.sin(theta_m + sensors.once_phase)
    if sensors.twice != 0.0:
        seen += sensors.twice * math.sin(2.0 * theta_m + sensors.twice_phase)
    return seen


@njit
def position_code(sensors, theta_m, sample):
    """Code 0..2^bits - 1 of the mechanical angle [rad] at a sample number, or of the resolver's own turn."""
    seen = sensed_angle(sensors, theta_m) + _noise(sensors.position_noise, sensors.seed, 4, sample)
    turns = seen * sensors.position_pole_pairs / (2.0 * math.pi)
    codes = 1 << sensors.position_bits
    part = turns - math.floor(turns)
    if sensors.position_counts > 0:
        part = (math.floor(part * sensors.position_counts) + 0.5) / sensors.position_counts
    return math.floor(part * codes + 0.5) % codes
