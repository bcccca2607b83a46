# SPDX-License-Identifier: BSD-3-Clause
"""A recording of a real drive as a run of the core: open loop, one row of the log in a PWM period.

The log's dq currents, speed and bus voltage become the codes that the converters and the resolver of
``drive.toml`` would have given.  One row of the log is one sample of the core: from row to row the angle
moves by speed times the core's sample time, not times the log's 29 ms, in which the rotor turns far.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fluxproof.checkout import recordings
from fluxproof.cosim.closed_loop import Comparison, Device, Result
from fluxproof.cosim.driven_plant import INPUT_PORTS, build_plant
from fluxproof.cosim.scenarios import RPM
from fluxproof.plant import sensor_params
from fluxproof.plant.sensors import current_code, position_code, u_dc_code
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.drive import Drive
from golden_model.formats import PU
from golden_model.registers import RegisterSet, registers
from golden_model.transforms import clarke, sincos
from golden_model.units import from_si

FILE = "emrax228/coastdown_run.csv"
PHASE_SHIFT = 2.0 * np.pi / 3.0
COLUMNS = {
    "t": "t_s",
    "i_d": "id_A",
    "i_q": "iq_A",
    "u_d": "vd_V",
    "u_q": "vq_V",
    "rpm": "n_rpm",
    "u_dc": "u_dc_V",
    "command": "current_cmd",
}


class Recording(NamedTuple):
    """Columns of the log, one element a row."""

    t: np.ndarray  # [s]
    i_d: np.ndarray  # [A], peak
    i_q: np.ndarray
    u_d: np.ndarray  # [V], peak, what the recorded controller asked for
    u_q: np.ndarray
    rpm: np.ndarray  # mechanical, negative is forward
    u_dc: np.ndarray  # [V]
    command: np.ndarray  # torque the rider asked for, 0 to 1

    def omega_me(self, pole_pairs: int) -> np.ndarray:
        """Electrical speed [rad/s], negative is forward as in the log."""
        return self.rpm * RPM * pole_pairs


def recording_path() -> tuple[Path, str | None]:
    """Where the recording should be, and why it is skipped, if it is."""
    path = recordings() / FILE
    return path, None if path.exists() else f"{FILE} is not there; FLUXPROOF_RECORDINGS names its folder"


def load_recording(path: Path | str) -> Recording:
    """Read the log; OSError where it is absent."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    return Recording(*(table[column] for column in COLUMNS.values()))


def angles(recording: Recording, drive: Drive) -> np.ndarray:
    """Electrical angle [rad] at every row: the speed of each row held for one sample time."""
    turned = np.cumsum(recording.omega_me(drive.machine.pole_pairs)) * drive.sample_time_s
    return np.concatenate(([0.0], turned[:-1]))


def sample_inputs(recording: Recording, drive: Drive) -> np.ndarray:
    """The core's input ports, one row per row of the log, columns as in fluxproof.Sample without ``run``.

    Torque mode: the q reference is the command times the current limit, with the sign of forward; d is zero.
    """
    codes = sensor_params(build_plant(drive)[1])
    theta = angles(recording, drive)
    rows = np.zeros((len(theta), len(fluxproof.Sample._fields) - 1), np.int64)
    for k, angle in enumerate(theta):
        for x in range(3):
            along = angle - x * PHASE_SHIFT
            current = recording.i_d[k] * np.cos(along) - recording.i_q[k] * np.sin(along)
            rows[k, x] = current_code(codes, x, current, k)
        rows[k, 3] = u_dc_code(codes, recording.u_dc[k], k)
        rows[k, 4] = position_code(codes, angle / drive.machine.pole_pairs, k)
        rows[k, 7] = from_si("i_q_ext", -recording.command[k] * drive.current_limit_a, drive)
    return rows


def current_bound(recording: Recording, drive: Drive) -> np.ndarray:
    """How far [A] the core's current vector may lie from the logged one, row by row, from the formats alone.

    Half a code of each converter and of the resolver, then the roundings on the way to i_d and i_q.
    """
    base, s = drive.bases.current_a, drive.sensors
    phase = s.current_range_a / 2.0**s.adc_bits + base * PU.lsb / 2.0
    vector = 4.0 / 3.0 * phase  # three phase errors of one size: (2/3) * |1 - a - a**2| = 4/3
    length = np.hypot(recording.i_d, recording.i_q) + vector
    angle = np.pi * drive.code_pairs / 2.0**s.position_bits
    # Along alpha three times, along beta sqrt(3) times the vector meets its coefficient's rounding.
    coefficients = np.hypot(3.0 * clarke.THIRD.fmt.lsb / 2.0, np.sqrt(12.0) * clarke.INV_SQRT12.fmt.lsb / 2.0)
    trig = np.sqrt(2.0) * sincos.bound(None, None)["cos_theta"]
    rounded = 2.0 * np.sqrt(2.0) * base * PU.lsb / 2.0  # Clarke and Park, two components each
    return vector + rounded + length * (angle + coefficients + trig)


@dataclass(frozen=True)
class Replay:
    """Rows of input ports, one in a PWM period: a run as cosim/runs.py has it."""

    registers: RegisterSet
    rows: np.ndarray

    @property
    def config(self) -> fluxproof.Config:
        return self.registers.config

    def __len__(self) -> int:
        return len(self.rows)

    async def on(self, device: Device, progress: Callable[[int, int], None]) -> Result:
        """Feed the rows to the device and compare as the closed loop does."""
        comparison = Comparison(device, self.registers)
        await comparison.start(1)
        for k, row in enumerate(self.rows.tolist()):
            await comparison.period(dict(zip(INPUT_PORTS, row, strict=True)), 1)
            progress(k + 1, len(self.rows))
        return comparison.finish()


def replay(recording: str, drive_file: str, carrier_half: int, rows: int | None = None) -> Replay:
    """The recording of this file, or its first ``rows``, through the drive's converters."""
    drive = drives.with_carrier(drives.load(Path(drive_file)), carrier_half)
    # The recorded machine does not follow this core's voltages, so that a lost encoder or a stall would be no finding.
    shown = dataclasses.replace(drive.protection, trip_encoder_lost=False, trip_stall=False)
    drive = dataclasses.replace(drive, protection=shown)
    return Replay(registers(drive), sample_inputs(load_recording(recording), drive)[:rows])
