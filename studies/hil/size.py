# SPDX-License-Identifier: BSD-3-Clause
"""What the motor takes of an FPGA and how long a step is, counted as everything in docs/synth.md."""

from __future__ import annotations

from golden_model.motor.motor_model import STEP
from scripts.synth.yosys import Design
from studies.hil.figure import most

CLOCK_MHZ = 200


def figures(_options) -> list[dict]:
    """The motor with inverter, map and tables; its sensors beside it."""
    counted = Design(quiet=True).blocks(["motor_model", "motor_sensors", "motor_encoder"], "xc7")
    (motor, *others) = counted.values()
    return [
        most("step of the motor", STEP, 20, "clocks"),
        most("step of the motor at 200 MHz", 1000 * STEP / CLOCK_MHZ, 100, "ns"),
        most("LUT of motor, inverter and map", motor.lut, 3000, "LUT"),
        most("DSP48 of motor, inverter and map", motor.dsp, 24, "DSP48"),
        most("block RAM of motor, inverter and map", motor.bram, 8, "RAMB36"),
        most("LUT of sensors and encoder", sum(row.lut for row in others), 600, "LUT"),
    ]
