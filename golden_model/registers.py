# SPDX-License-Identifier: BSD-3-Clause
"""Converts a drive in SI units to the integers of the core's registers: docs/drives/*.toml -> Registers, Config.

``integer = SI value / scale / LSB``, rounded half up; scaling.py gives the value and scale of each register.
Dead time and minimum pulse are rounded up, because they must not be shorter than specified.
"""

import math
from typing import NamedTuple

import numpy as np

from golden_model.control.reference_table import BLANK
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.fluxproof import NEEDS, REGISTERS, Config, Registers
from golden_model.scaling import PARTS, ROUND_UP, gates
from golden_model.table_scaling import references, table_of
from golden_model.units import TURN_RAD


class Row(NamedTuple):
    """One register as printed; ``error`` = represented - SI, ``relative`` = error / SI or None at zero."""

    name: str
    si: float
    unit: str
    integer: int
    represented: float
    error: float
    relative: float | None
    low: int
    high: int


class RegisterSet(NamedTuple):
    """Register integers, generics of the top entity, and one row per register with its derivation."""

    values: Registers
    config: Config
    rows: tuple[Row, ...]
    table: np.ndarray = BLANK  # words of the torque table, see reference_table


def registers(drive: Drive, flux=None) -> RegisterSet:
    """All registers of a drive; DriveError names the keys behind a value that is out of range.

    ``flux``: the measured flux linkage of the machine for the torque table, see torque_table.measured.
    """
    table = table_of(drive, flux) if drive.core.references else None
    entries = {e.name: e for part in PARTS for e in part(drive)} | {e.name: e for e in references(drive, table)}
    core = drive.core
    built = {name for name, generic in NEEDS.items() if not generic or getattr(core, generic)}
    rows = {name: (_row if name in built else _left_out)(entries[name], port) for name, port in REGISTERS.items()}
    _keep_pulse_above_dead_time(rows, drive)
    generics = (
        drive.carrier_half,
        int(core.estimators),
        int(core.references),
        int(core.position_loop),
        int(core.residual),
        int(core.modes),
        int(core.overmodulation),
        int(core.gearing),
    )
    config = Config(drive.sensors.adc_bits, drive.sensors.position_bits, *generics)
    values = Registers(*(rows[name].integer for name in REGISTERS))
    words = BLANK if table is None else table.words(drive.bases, drive.torque_base_nm)
    return RegisterSet(values, config, tuple(rows.values()), words)


def _row(entry, port):
    """The entry as an integer of the port's format; DriveError if it does not fit."""
    lsb, up = port.fmt.lsb, entry.name in ROUND_UP
    value = entry.si / entry.scale if entry.scale else math.inf
    if not math.isfinite(value / lsb):
        raise DriveError(f"register {entry.name} from {entry.keys}: these values give no number")
    # A value within a relative 1e-9 above a whole number of clocks is that number: rounding of the division.
    integer = math.ceil(value / lsb * (1.0 - 1e-9)) if up else math.floor(value / lsb + 0.5)
    if entry.unit == "rad":
        integer %= port.fmt.hi + 1  # an angle wraps: just below a turn rounds to zero
    if not port.low <= integer <= port.high:
        lo, hi = (f"{end * lsb * entry.scale:.6g}" for end in (port.low, port.high))
        unit = "" if entry.unit == "1" else f" {entry.unit}"
        raise DriveError(
            f"register {entry.name} from {entry.keys}: {entry.si:.6g}{unit} is {integer:.12g}, out of range: "
            f"allowed is {port.low} to {port.high}, that is {lo} to {hi}{unit}"
        )
    if integer == 0 and entry.si != 0.0 and entry.unit not in ("rad", "code"):
        least = lsb * entry.scale / 2.0
        raise DriveError(
            f"register {entry.name} from {entry.keys}: {entry.si:.6g} {entry.unit} rounds to zero: "
            f"allowed is 0 or at least {least:.6g} {entry.unit}"
        )
    return _printed(entry, port, integer)


def _left_out(entry, port):
    """The reset value, which is all that the register of a part that is not built can hold."""
    reset = max(port.low, min(port.high, 0))
    return _printed(entry._replace(si=reset * port.fmt.lsb * entry.scale), port, reset)


def _printed(entry, port, integer):
    represented = integer * port.fmt.lsb * entry.scale
    error = represented - entry.si
    if entry.unit == "rad":
        error = (error + math.pi) % TURN_RAD - math.pi
    relative = error / entry.si if entry.si else None
    return Row(entry.name, entry.si, entry.unit, integer, represented, error, relative, port.low, port.high)


def _keep_pulse_above_dead_time(rows, drive):
    """Both times are rounded up, so that their difference may lose a clock: what min_on_time_s asks for is kept."""
    dead, most = rows["dead_time"].integer, min(drive.carrier_half, REGISTERS["min_pulse"].high)
    asked = drive.inverter.min_on_time_s or 0.0
    least = dead + max(math.ceil(asked * drive.core.clock_hz * (1.0 - 1e-9)), 1)
    pulse = max(rows["min_pulse"].integer, least)
    entry = next(e for e in gates(drive) if e.name == "min_pulse")
    if pulse > most:
        raise DriveError(
            f"register min_pulse from {entry.keys}: {pulse} clocks is out of range: allowed is {least} to {most}"
        )
    rows["min_pulse"] = _printed(entry, REGISTERS["min_pulse"], pulse)
