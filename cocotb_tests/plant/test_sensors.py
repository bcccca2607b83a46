# SPDX-License-Identifier: BSD-3-Clause
"""Codes of the converters, bus and position, and the noise on them."""

import math

import numpy as np
import pytest

from fluxproof.plant import Sensors, current_code, hash_normal, position_code, sensor_params, u_dc_code


@pytest.mark.parametrize("bits", [12, 14, 16])
def test_current_codes(bits):
    s = sensor_params(Sensors(current_bits=bits, current_full_scale_a=10.0))
    lsb, middle = 20.0 / 2**bits, 2 ** (bits - 1)
    assert current_code(s, 0, 0.0, 0) == middle
    assert current_code(s, 1, 100 * lsb, 0) == middle + 100
    assert current_code(s, 2, -11.0, 0) == 0
    assert current_code(s, 2, 11.0, 0) == 2**bits - 1
    off = sensor_params(
        Sensors(current_bits=bits, current_offset_a=(0.0, 5 * lsb, 0.0), current_gain_error=(0.0, 0.0, 0.01))
    )
    assert [current_code(off, k, 1000 * lsb, 0) - middle for k in range(3)] == [1000, 1005, 1010]


def test_bus_and_position_codes():
    s = sensor_params(Sensors())
    assert u_dc_code(s, 500.0, 0) == 2048
    assert u_dc_code(s, -5.0, 0) == 0
    assert u_dc_code(s, 2000.0, 0) == 4095
    assert position_code(s, 2 * np.pi * 100.25, 0) == 1024
    assert position_code(s, -1e-9, 0) == 0
    turned = sensor_params(Sensors(position_direction=-1, position_offset_rad=np.pi))
    assert position_code(turned, np.pi / 2, 0) == 1024
    bent = sensor_params(Sensors(position_bits=20, eccentricity_once_rad=0.01, eccentricity_twice_rad=0.02))
    seen = position_code(bent, 1.0, 0) * 2 * np.pi / 2**20
    assert seen == pytest.approx(1.0 + 0.01 * math.sin(1.0) + 0.02 * math.sin(2.0), abs=2 * np.pi / 2**20)


def test_noise_is_normal_independent_and_repeatable():
    draws = np.array([[hash_normal(7, c, k) for k in range(20_000)] for c in range(3)])
    # Standard errors for 20,000 draws: mean 0.007, deviation 0.005, kurtosis 0.035, correlation 0.007.
    assert np.abs(draws.mean(axis=1)).max() < 0.03
    assert np.abs(draws.std(axis=1) - 1.0).max() < 0.025
    assert np.abs((draws**4).mean(axis=1) - 3.0).max() < 0.3
    assert np.abs(np.corrcoef(draws) - np.eye(3)).max() < 0.03
    assert np.abs([np.mean(d[1:] * d[:-1]) for d in draws]).max() < 0.03
    assert hash_normal(7, 1, 11) == draws[1, 11] != hash_normal(8, 1, 11)
