# SPDX-License-Identifier: BSD-3-Clause
"""What `fluxproof project --hil` needs beside the usual files: the drive as the motor in the FPGA has it, its words."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from fluxproof.diagnosis.ground.plant_section import Plant, plant_of
from fluxproof.hil.load import load_words
from fluxproof.hil.registers import Thermal
from fluxproof.quote import c_comment
from fluxproof.simulate.run import bus_of
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.front_ends import Converters
from golden_model.generated.register_names import ADDRESSES

NAME = "motor_registers.h"


def drive_of(drive: Drive) -> Drive:
    """The drive with converters that give codes: there is no analogue signal to convert."""
    return dataclasses.replace(drive, converters=Converters())


def thermal_of(plant: Plant) -> Thermal | None:
    """The bodies that [plant.hil] describes; None: no temperature changes.  DriveError where a key lacks."""
    keys = ("winding_j_per_k", "winding_s", "magnet_s")
    given = [getattr(plant.hil, key) for key in keys]
    if not any(given):
        return None
    if not all(given):
        missing = ", ".join(key for key, value in zip(keys, given, strict=True) if not value)
        raise DriveError(f"[plant.hil] needs {missing} as well: the motor in the FPGA warms with {', '.join(keys)}")
    machine = plant.machine
    if machine.temperature_magnet_c != machine.temperature_winding_c:
        raise DriveError(
            f"[plant.machine] temperature_magnet_c = {machine.temperature_magnet_c:g} differs from "
            f"temperature_winding_c = {machine.temperature_winding_c:g}: "
            "with [plant.hil] both warm from one temperature, the ambient's"
        )
    return Thermal(*given, ambient_c=machine.temperature_winding_c)


def header(path: str, drive: Drive) -> str:
    """What load_motor.c includes; DriveError where the motor in the FPGA cannot be that of the drive file."""
    plant = plant_of(path)
    body = thermal_of(plant)
    parts = plant.machine, plant.inverter, plant.sensors, bus_of(drive)
    words = load_words(drive, *parts, body, plant.hil.current_filter_s)
    rows = [f"    {{0x{ADDRESSES[name]:03X}, {value}}}, /* {name} */" for name, value in words]
    comment = c_comment(
        f"{Path(path).name} by `fluxproof project --hil`: the motor in the FPGA, that of [machine], [inverter],",
        "[supply] and [plant.*].  Write each value to its offset, in this order, with the gates off.",
    )
    lines = [comment, "#ifndef FLUXPROOF_MOTOR_H", "#define FLUXPROOF_MOTOR_H", "#include <stdint.h>", ""]
    lines += ["static const struct { uint16_t offset; int32_t value; } fluxproof_motor[] = {", *rows, "};", "#endif"]
    return "\n".join(lines) + "\n"
