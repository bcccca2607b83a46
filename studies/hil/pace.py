# SPDX-License-Identifier: BSD-3-Clause
"""How long a step of the motor is.  What it takes of an FPGA: `python -m scripts.synth --block motor_model`."""

from __future__ import annotations

from golden_model.motor.motor_model import STEP
from studies.hil.figure import most

CLOCK_MHZ = 200


def figures(_options) -> list[dict]:
    """The step in clocks, and its time at the clock that is aimed at."""
    return [
        most("step of the motor", STEP, 20, "clocks"),
        most("step of the motor at 200 MHz", 1000 * STEP / CLOCK_MHZ, 100, "ns"),
    ]
