# SPDX-License-Identifier: BSD-3-Clause
"""What software writes into the motor of fluxproof_hil: the motor and the sensors of a drive file, as register words.

[(register, word), ...] = load_words(drive, machine, inverter, sensors, ...)     in the order of writing

The rotor is held at the angle zero while they are written.  Of the tables only words that are not zero are written:
block RAM is zero after configuration; ``erase_words()`` are those of a motor that had others before.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np

from fluxproof.hil.registers import (
    Thermal,
    bus_registers,
    code,
    filter_register,
    heat_registers,
    motor_registers,
    motor_scale,
    motor_tables,
)
from fluxproof.plant import Bus, Inverter, Machine, Sensors
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.formats import MOTOR_ANGLE
from golden_model.io import motor_map
from golden_model.motor import motor_heat, motor_sensors
from golden_model.motor.motor_model import Tables

HALF = 1 << motor_map.HALF_WORD.width
BELL = math.sqrt(4 * (256**2 - 1) / 12)  # standard deviation of the sum of four bytes
ENCODERS = ("code", "abz", "hall")  # that motor_bench has
Word = tuple[str, int]
IDEAL = Bus()


def load_words(
    drive: Drive,
    machine: Machine,
    inverter: Inverter,
    sensors: Sensors,
    bus: Bus = IDEAL,
    thermal: Thermal | None = None,
    current_filter_s: float = 0.0,
) -> list[Word]:
    """Everything, the start first and its end last; DriveError where the motor cannot be what is asked for.

    Without thermal bodies R and magnets are for good those of the machine's temperatures.
    """
    refuse(drive, machine, sensors)
    try:
        scale = motor_scale(machine, drive.inverter.dc_bus_v, drive.sensors.current_range_a, drive.core.clock_hz)
        hot = motor_registers(scale, at_its_temperatures(machine), inverter)
        values = hot if thermal is None else motor_registers(scale, machine, inverter)._replace(psi_start=hot.psi_start)
        values = values._asdict() | {"u_dc": scale.u_dc(drive.inverter.dc_bus_v)}
        values |= bus_registers(scale, bus)._asdict() | heat_registers(scale, machine, thermal)._asdict()
        if thermal is None:  # what motor_temp_winding shows
            values["ambient"] = code("ambient", machine.temperature_winding_c, motor_heat.CELSIUS)
        values |= sensor_registers(drive, sensors, scale.current_a, scale.voltage_v)
        values["k_filter"] = filter_register(scale, current_filter_s)
        tables = motor_tables(scale, at_its_temperatures(machine) if thermal is None else machine)
    except ValueError as error:
        raise DriveError(str(error)) from None
    rows = [(name, value) for name, value in values.items() if name in motor_map.COMMANDS]
    words = [("start", 1), ("load", 0), *rows, *table_words(tables), ("clear_faults", 1), ("start", 0)]
    return [(motor_map.PREFIX + name, value) for name, value in words]


def at_its_temperatures(machine: Machine) -> Machine:
    """The same machine, described at the temperatures of its winding and of its magnets."""
    m, ref = machine, machine.temperature_ref_c
    return dataclasses.replace(
        machine,
        resistance_ohm=m.resistance_ohm * (1.0 + m.resistance_temp_coeff_per_k * (m.temperature_winding_c - ref)),
        magnet_flux_wb=m.magnet_flux_wb * (1.0 + m.magnet_temp_coeff_per_k * (m.temperature_magnet_c - ref)),
    )


def refuse(drive: Drive, machine: Machine, sensors: Sensors) -> None:
    """DriveError for what the motor in the FPGA does not have."""
    if drive.encoder.kind not in ENCODERS:
        allowed = ", ".join(ENCODERS)
        raise DriveError(f'[encoder] kind = "{drive.encoder.kind}": the motor in the FPGA has {allowed}')
    absent = {
        "[plant.sensors] eccentricity_once_rad": sensors.eccentricity_once_rad,
        "[plant.sensors] eccentricity_twice_rad": sensors.eccentricity_twice_rad,
        "[plant.sensors] position_noise_rad": sensors.position_noise_rad,
        "[sensors] position_pole_pairs beyond one": sensors.position_pole_pairs - 1,
        "[plant.machine] iron_conductance_s": machine.iron_conductance_s,
        "[plant.machine] shorted_share": machine.shorted_share,
    }
    for key, value in absent.items():
        if value:
            raise DriveError(f"{key} = {value:g}: the motor in the FPGA has none, allowed is 0")
    if machine.flux_map is not None:
        raise DriveError(
            "[plant.machine] flux_map: the motor in the FPGA saturates by saturation_d_per_a2 and the like"
        )
    if sensors.position_direction < 0:
        raise DriveError("[sensors] position_reverse: the motor in the FPGA counts forward, allowed is false")


def sensor_registers(drive: Drive, sensors: Sensors, current_a: float, voltage_v: float) -> dict[str, int]:
    """The registers of motor_sensors and motor_encoder; ValueError for a value that does not fit."""
    ports = {port.name: port.fmt for port in motor_sensors.BLOCK.registers}
    amps, volts = sensors.current_full_scale_a, sensors.u_dc_full_scale_v
    given = {
        **{f"scale_{x}": (1.0 + e) * current_a / amps for x, e in zip("abc", sensors.current_gain_error, strict=True)},
        **{f"zero_{x}": offset / amps for x, offset in zip("abc", sensors.current_offset_a, strict=True)},
        "scale_u": (1.0 + sensors.u_dc_gain_error) * 2.0 * voltage_v / volts,
        "zero_u": 2.0 * sensors.u_dc_offset_v / volts,
        "noise_i": sensors.current_noise_a / amps / BELL,
        "noise_u": 2.0 * sensors.u_dc_noise_v / volts / BELL,
    }
    found = {name: code(name, value, ports[name]) for name, value in given.items()}
    turns = sensors.position_offset_rad / (2.0 * math.pi)
    counts = drive.encoder.counts if drive.encoder.kind == "abz" else 0
    return found | {
        "angle_offset": round(turns / MOTOR_ANGLE.lsb) % (1 << MOTOR_ANGLE.width),
        "counts": counts or 0,
        "hall_offset": 0,
    }


def table_words(tables: Tables) -> Iterator[Word]:
    """The writes of the words that are not zero."""
    for select, (high, low) in enumerate(
        [(tables.map_d.ravel(), tables.map_q.ravel()), (tables.wave_d, tables.wave_q), (None, tables.cogging)]
    ):
        high = np.zeros_like(low) if high is None else high
        yield from _written(select, high, low, np.flatnonzero((high != 0) | (low != 0)))


def erase_words() -> list[Word]:
    """Zeros into every word of every table."""
    none = np.zeros(1 << 12, np.int64)
    words = [w for select, size in ((0, 4096), (1, 1024), (2, 1024)) for w in _written(select, none, none, range(size))]
    return [(motor_map.PREFIX + name, value) for name, value in words]


def _written(select, high, low, places) -> Iterator[Word]:
    yield "table_select", select
    for at in places:
        yield "table_at", int(at)
        yield "table_high", int(high[at]) % HALF
        yield "table_low", int(low[at]) % HALF
        yield "table_write", 1
