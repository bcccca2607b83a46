# SPDX-License-Identifier: BSD-3-Clause
"""The trims of the sensors with which a recording was made: a dump holds its registers, which the drive file may not.

A reading includes the trims in force when it was recorded.  A drive file that was improved since has others; an error
found in the recording counts from those that ran, or a trim would be applied twice.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

from fluxproof.diagnosis.ground.nominal import Nominal
from golden_model.fluxproof import REGISTERS
from golden_model.formats import TURN
from golden_model.units import TURN_RAD

PHASES = "abc"
Trim = tuple[float, ...]


def as_ran(nominal: Nominal, recordings) -> tuple[Nominal, dict[str, tuple[Trim, Trim]]]:
    """(the drive with the trims that ran, {key of [sensors]: (value that ran, value of the file)} where they differ).

    The trims are those of the first recording with registers; without any the drive stays as it is.
    """
    meta = next((r.meta for r in recordings if {"registers", "config", "telemetry"} <= set(r.meta)), None)
    if meta is None:
        return nominal, {}
    ran: dict[str, Any] = {}
    differ: dict[str, tuple[Trim, Trim]] = {}
    for key, value, steps in _of_registers(meta, nominal):
        stated = _stated(nominal, key)
        if any(_apart(key, a, b) > step for a, b, step in zip(value, stated, steps, strict=True)):
            first, *more = value
            ran[key] = value if more else first
            differ[key] = value, stated
    return dataclasses.replace(nominal, sensors=dataclasses.replace(nominal.sensors, **ran)), differ


def _stated(nominal: Nominal, key: str) -> Trim:
    """The value of the drive file, always a tuple."""
    value = getattr(nominal.sensors, key)
    if value is None:  # the code of zero current
        value = (2.0 ** ((nominal.sensors.adc_bits or 1) - 1),) * len(PHASES)
    return value if isinstance(value, tuple) else (value,)


def _apart(key, a, b) -> float:
    return abs(math.remainder(a - b, TURN_RAD)) if key == "theta_offset_rad" else abs(a - b)


def _of_registers(meta, nominal: Nominal) -> Iterator[tuple[str, Trim, Trim]]:
    """(key of [sensors], values that ran, resolution of their registers) of what [sensors] describes."""
    regs, s, bases = meta["registers"], nominal.sensors, meta["telemetry"]["bases"]
    step = TURN.lsb * TURN_RAD
    yield "theta_offset_rad", (math.remainder(regs["theta_offset"] * step, TURN_RAD),), (step,)
    if s.adc_bits is None or s.adc_bits != meta["config"]["adc_bits"]:
        return
    code = 2.0 ** (s.adc_bits - 16)  # codes are left-aligned in 16 bits

    def gains(names, full, base):
        steps = tuple(REGISTERS[name].fmt.lsb * base / full for name in names)
        return tuple(regs[name] * step for name, step in zip(names, steps, strict=True)), steps

    if s.current_range_a is not None:
        yield "current_offset_code", tuple(regs[f"offset_{x}"] * code for x in PHASES), (code,) * len(PHASES)
        yield "current_gain", *gains([f"gain_{x}" for x in PHASES], s.current_range_a, bases["current_a"])
    if s.u_dc_range_v is not None:
        yield "u_dc_offset_code", (regs["u_dc_offset"] * code,), (code,)
        yield "u_dc_gain", *gains(["u_dc_gain"], s.u_dc_range_v / 2.0, bases["voltage_v"])
