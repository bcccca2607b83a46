# SPDX-License-Identifier: BSD-3-Clause
"""still_check with the registers of the drive files: shafts that stop are not told to stand, frozen codes are."""

from __future__ import annotations

import numpy as np
import pytest

from fluxproof.checkout import DRIVES
from golden_model.drive import Drive, load
from golden_model.io import still_check
from golden_model.protection_limits import finest
from golden_model.registers import registers

NAMES = ("brusa_hsm1", "drone_24v", "emrax228", "paper000", "paper001", "servo_24v", "spindle_400v")
BITS = 18
WITHIN_S = {0.1: 2e-3, 0.8: 2e-3, -0.3: 2e-3}


def braking(drive: Drive) -> float:
    """What the torque at the current limit does to the shaft [rad/s in a sample]."""
    m = drive.machine
    torque = 1.5 * m.pole_pairs * m.magnet_flux_wb * drive.current_limit_a
    return torque / m.inertia_kgm2 * drive.sample_time_s


def stands(drive: Drive, omega: np.ndarray, frozen_at: int | None = None, noise: float = 0.0) -> np.ndarray:
    """What the check tells of a shaft with these speeds [rad/s], a value each sample; noise in codes."""
    rng, values, codes = np.random.default_rng(7), registers(drive).values, finest(drive)
    turns = np.cumsum(omega) * drive.sample_time_s / (2 * np.pi) * drive.sensors.position_pole_pairs
    place = np.floor(turns * codes + noise * rng.normal(size=len(omega)))
    if frozen_at is not None:
        place[frozen_at:] = place[frozen_at]
    told, state = np.zeros(len(omega), np.int64), still_check.State()
    for k, code in enumerate((place * (2**BITS / codes)).astype(np.int64) % 2**BITS):
        state, (told[k], _) = still_check.step(
            state, int(code), 0, 1, 0, values.still_turn, values.slow_turn, BITS
        )  # fmt: skip
    return told


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("noise", (0.0, 0.4))
def test_a_shaft_that_stops_reverses_or_rests_does_not_stand(name, noise):
    drive = load(DRIVES / f"{name}.toml")
    for part in (0.3, -0.03, 0.004):
        start, brake = part * drive.machine.rated_speed_rad_s, np.sign(part) * braking(drive)
        least = -start if part == 0.3 else 0.0  # a reversal, or a stop
        slope = start - brake * np.arange(min(int(2 * abs(start / brake)) + 1, 1500))
        slope = np.maximum(slope, least) if start > 0 else np.minimum(slope, least)
        omega = np.concatenate((np.full(150, start), slope, np.full(150, slope[-1] if part == 0.3 else 0.0)))
        assert not stands(drive, omega, noise=noise).any(), part


@pytest.mark.parametrize("name", NAMES)
def test_a_frozen_code_stands(name):
    drive = load(DRIVES / f"{name}.toml")
    for part, within in WITHIN_S.items():
        omega = np.full(1200, part * drive.machine.rated_speed_rad_s)
        told = stands(drive, omega, 1000)
        assert not told[:1001].any() and told[-1] and np.argmax(told[1001:]) * drive.sample_time_s < within, part
