# SPDX-License-Identifier: BSD-3-Clause
"""The example's hardware as it is, what its drive file does not know of it, and the operating points of the run."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fluxproof.cosim.driven_plant import Scenario, described_sensors
from fluxproof.plant import Inverter, Machine, Sensors
from golden_model.drive import Drive
from golden_model.units import si_per_lsb

DRIVE_FILE = Path(__file__).with_name("drive.toml")
MAGNET_SHARE = 0.92  # of the flux in the drive file: magnets that were too hot once
ENCODER_RAD = math.radians(2.0)  # electrical angle by which the encoder is mounted wrongly
DEAD_TIME_S = 2e-6

RAMP, DWELL = 100, 450  # rows from one operating point to the next, and at it
# Mechanical speeds [rad/s], each with currents i_d, i_q [A] in an order of its own, so that nothing follows the time.
SPEEDS = (30.0, 150.0, -90.0)
CURRENTS = ((0.0, 0.0), (0.0, 4.5), (-2.5, 2.0), (0.0, -4.5), (-2.5, -3.0), (2.0, 1.0))
PLAN = tuple((speed, *point) for turn, speed in enumerate(SPEEDS) for point in CURRENTS[turn:] + CURRENTS[:turn])


class Hidden(NamedTuple):
    """A difference between the motor and its drive file, under the names that the diagnosis has for it."""

    effect: str
    parameter: str
    value: float  # true value in the parameter's unit
    words: str


def hidden(drive: Drive) -> list[Hidden]:
    """All differences; everything else is as the drive file says."""
    flux = MAGNET_SHARE * drive.machine.magnet_flux_wb
    volts = DEAD_TIME_S * drive.inverter.pwm_frequency_hz * drive.inverter.dc_bus_v
    lost = f"{1e6 * DEAD_TIME_S:g} us of dead time take voltage away"
    return [
        Hidden("dead_time", "v_dead_v", volts, lost),
        Hidden("magnet_flux", "magnet_flux_wb", flux, f"magnets {100.0 * (MAGNET_SHARE - 1.0):+.0f} %"),
        Hidden("encoder_offset", "offset_rad", ENCODER_RAD, f"encoder {math.degrees(ENCODER_RAD):g} degrees off"),
    ]


def machine(drive: Drive) -> Machine:
    """The motor: that of the drive file with weaker magnets."""
    described = Machine.from_mapping(vars(drive.machine))
    return dataclasses.replace(described, magnet_flux_wb=MAGNET_SHARE * described.magnet_flux_wb)


def inverter() -> Inverter:
    """The inverter as the averaged plant has it; a switching plant follows the core's gates instead."""
    return Inverter(dead_time_s=DEAD_TIME_S)


def sensors(drive: Drive) -> Sensors:
    """Converters with noise and small offsets, as all have, and the encoder."""
    return dataclasses.replace(
        described_sensors(drive),
        current_noise_a=0.004,
        current_offset_a=(0.003, -0.004, 0.002),
        u_dc_noise_v=0.2,
        position_offset_rad=ENCODER_RAD / drive.machine.pole_pairs,
    )


def scenario(drive: Drive, turns: int = 1) -> Scenario:
    """A test bench imposes the speeds of PLAN, ``turns`` times; the core regulates its currents; for IMPOSED_SPEED."""
    points = np.tile(PLAN, (turns, 1))
    before = np.concatenate([np.zeros((1, 3)), points[:-1]])
    rise = np.minimum((np.arange(RAMP + DWELL) + 1) / RAMP, 1.0)[None, :, None]
    speed, i_d, i_q = np.concatenate(before[:, None, :] + rise * (points - before)[:, None, :]).T
    none = np.zeros(len(speed), np.int64)

    def integers(name: str, values: np.ndarray) -> np.ndarray:
        return np.round(values / si_per_lsb(name, drive)).astype(np.int64)

    return Scenario(
        omega_ref=none,
        load=speed,
        u_dc=np.full(len(speed), float(drive.inverter.dc_bus_v)),
        i_d_ref=integers("i_d_ref", i_d),
        i_q_ext=integers("i_q_ext", i_q),
        speed_mode=none,
        enable=np.ones(len(speed), np.int64),
    )
