# SPDX-License-Identifier: BSD-3-Clause
"""The example's recording: the golden core in closed loop with the motor of motor.py, as the core's telemetry."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from fluxproof.diagnosis.example import motor
from fluxproof.diagnosis.replay.capture import capture
from fluxproof.diagnosis.replay.telemetry import is_dump, write_dump
from fluxproof.files import write_bytes
from fluxproof.plant import IMPOSED_SPEED
from golden_model import drive as drives
from golden_model.drive_keys import DriveError
from golden_model.io import telemetry_words
from golden_model.registers import registers

RECORDING, DRIVE = "example.fluxdump", "drive.toml"


class Example(NamedTuple):
    """The two files of the ordinary command."""

    recording: Path
    drive: Path


def write(folder: Path) -> Example:
    """Run the golden core and write its telemetry and the drive file; DriveError before a file of the user is lost."""
    example = files_in(folder)
    drive = drives.load(motor.DRIVE_FILE)
    settings = registers(drive)
    samples, observed, _ = capture(
        drive,
        settings,
        motor.scenario(drive),
        machine=motor.machine(drive),
        inverter=motor.inverter(),
        sensors=motor.sensors(drive),
        mode=IMPOSED_SPEED,
    )
    write_files(example, drive, settings, samples, observed)
    return example


def files_in(folder: Path) -> Example:
    """The example's files in a folder; DriveError where other files have their names."""
    example = Example(folder / RECORDING, folder / DRIVE)
    ours = not example.recording.exists() or is_dump(example.recording)
    if example.drive.exists():
        ours = ours and example.drive.read_bytes() == motor.DRIVE_FILE.read_bytes()
    if not ours:
        names = f"{RECORDING} or {DRIVE}"
        raise DriveError(f"{folder}: has another {names}, which would be overwritten; choose another folder")
    return example


def write_files(example: Example, drive, settings, samples: np.ndarray, observed: dict[str, np.ndarray]) -> None:
    """The words of the core's telemetry packet, and the drive file beside them; arrays as write_dump takes them."""
    write_bytes(example.drive, motor.DRIVE_FILE.read_bytes())
    packet = {name: observed[name] for name in telemetry_words.PACKET}
    write_dump(example.recording, drive, settings, samples, packet)
