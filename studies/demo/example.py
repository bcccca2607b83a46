# SPDX-License-Identifier: BSD-3-Clause
"""The demo's second half: the RTL drives the motor of `fluxproof diagnose --example`, and its telemetry is diagnosed.

The motor differs from its drive file; the currents follow their references all the same, as the loop is closed.  What
the core was given and what it put out are written as its telemetry and go through the ordinary command.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from fluxproof.cosim.runs import ClosedLoop, InVerilator
from fluxproof.diagnosis import session
from fluxproof.diagnosis.example import motor, recording
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.ground.result import Diagnosis as Answer
from fluxproof.plant import IMPOSED_SPEED
from golden_model import drive as drives
from golden_model.drive_keys import DriveError
from golden_model.registers import registers


def in_the_loop(carrier_half: int, periods: int | None = None) -> ClosedLoop:
    """The example's run, or its first ``periods``, for an RTL with so many clocks in half a period.

    The RTL's gates switch the motor's inverter.
    """
    drive = drives.with_carrier(drives.load(motor.DRIVE_FILE), carrier_half)
    machine, sensors, scenario = motor.machine(drive), motor.sensors(drive), motor.scenario(drive).first(periods)
    return ClosedLoop(drive, registers(drive), scenario, machine, sensors=sensors, mode=IMPOSED_SPEED)


def run_length() -> int:
    """Rows of an operating point, ramp included."""
    return motor.RAMP + motor.DWELL


class Diagnosis:
    """What `fluxproof diagnose` does, on what the RTL left behind; shown beside the runs."""

    starts, total = "running", 1

    def __init__(self, job: InVerilator, folder: Path):
        self.name, self.job, self.folder = "diagnosis", job, folder
        self.files = recording.Example(folder / recording.RECORDING, folder / recording.DRIVE)
        self.begun, self.seconds = False, 0.0
        self.problem: str | None = None
        self.answer: Answer | None = None

    def carry_out(self) -> None:
        """Write the telemetry and diagnose it; afterwards ``problem`` says what failed, or None."""
        if self.job.problem:
            self.problem = f"not done: {self.job.name} failed"
            return
        self.begun, began = True, time.monotonic()
        files, run, arrays = self.files, self.job.run, self.job.arrays()
        try:
            recording.write_files(files, run.drive, run.registers, arrays["samples"], observed(arrays))
            self.answer = session.run([files.recording], files.drive, self.folder)
        except (DriveError, RecordingError, OSError) as error:
            self.problem = str(error)
        self.seconds = time.monotonic() - began

    def done(self) -> int:
        """1 if there is an answer."""
        return int(self.answer is not None)

    def summary(self) -> dict:
        """diagnosis.json; empty without an answer."""
        return self.answer.to_json() if self.answer else {}


def observed(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The core's values in a run's arrays, by their names in fluxproof.Observed."""
    head = "observed_"
    return {name[len(head) :]: values for name, values in arrays.items() if name.startswith(head)}
