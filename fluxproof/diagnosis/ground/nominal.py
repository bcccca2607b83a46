# SPDX-License-Identifier: BSD-3-Clause
"""The nominal drive: the parameters of the simulation, read from drive.toml.

Every key of the core's drive.toml is accepted, but only those that the balance needs are required, so
that a drive without the core can be described too.  A missing key is None, and its effect is not part of the nominal
model.  [columns] maps names of a recording's file to canonical ones, [constants] gives values of columns that the file
lacks.  [plant.machine], [plant.inverter],
[plant.sensors] and [plant.timing] contain physics that the core does not use, as in an improved drive;
diagnosis/ground/plant_section.py builds the plant.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fluxproof.quote import shown
from golden_model import drive
from golden_model.drive_file import read_sections, read_tables
from golden_model.drive_keys import DriveError, key_of
from golden_model.front_ends import Converters, Encoder
from golden_model.motion import Position
from golden_model.supply import Supply


def _any_drive(kind: type, name: str, default: Any = dataclasses.MISSING, **limits: int) -> Any:
    """A key of the core's section with another default or other ``limits`` (lo, hi): formats of the core allow less."""
    key = next(key_of(f) for f in dataclasses.fields(kind) if f.name == name)
    return dataclasses.field(default=default, metadata={"key": dataclasses.replace(key, **limits)})


@dataclass(frozen=True)
class Machine(drive.Machine):
    """[machine] of any drive."""

    pole_pairs: int = _any_drive(drive.Machine, "pole_pairs", lo=1, hi=1000)
    rated_speed_rad_s: float | None = _any_drive(drive.Machine, "rated_speed_rad_s", None)


@dataclass(frozen=True)
class Inverter(drive.Inverter):
    """[inverter] of any drive."""

    dead_time_s: float | None = _any_drive(drive.Inverter, "dead_time_s", None)


@dataclass(frozen=True)
class Control(drive.Control):
    """[control] of any drive."""

    current_bandwidth_hz: float | None = _any_drive(drive.Control, "current_bandwidth_hz", None)


@dataclass(frozen=True)
class Sensors(drive.Sensors):
    """[sensors] of any drive."""

    adc_bits: int | None = _any_drive(drive.Sensors, "adc_bits", None, lo=1, hi=32)
    current_range_a: float | None = _any_drive(drive.Sensors, "current_range_a", None)
    u_dc_range_v: float | None = _any_drive(drive.Sensors, "u_dc_range_v", None)
    position_bits: int | None = _any_drive(drive.Sensors, "position_bits", None, lo=1, hi=32)


@dataclass(frozen=True)
class Core(drive.Core):
    """[core] of any drive."""

    clock_hz: float | None = _any_drive(drive.Core, "clock_hz", None)


RELUCTANCE = 0.05  # of the flux of rated current: with less the magnets do not count
NO_MAGNETS = 1e-6  # the same, in place of no flux
MOST_MAP_BYTES = 20_000_000  # of a flux map's CSV

SECTIONS = drive.SECTIONS | {
    "machine": Machine,
    "inverter": Inverter,
    "control": Control,
    "sensors": Sensors,
    "core": Core,
}


@dataclass(frozen=True)
class Nominal:
    """The sections of drive.toml as objects with the attribute names of its keys, SI units, peak values."""

    machine: Machine
    inverter: Inverter
    control: Control
    sensors: Sensors
    core: Core
    bases: drive.BaseChoice
    protection: drive.Protection
    sampling: drive.Sampling
    encoder: Encoder
    converters: Converters
    supply: Supply
    position: Position
    columns: dict = field(default_factory=dict)
    path: str = ""
    plant: dict = field(default_factory=dict)
    constants: dict = field(default_factory=dict)

    @property
    def sample_time_s(self) -> float:
        """Time between two consecutive rows [s]."""
        period = 1.0 / self.inverter.pwm_frequency_hz
        return self.control.sample_time_s or period / self.core.updates_per_period


def flux_level(machine: Machine) -> float:
    """Flux linkage [Wb] that limits the speed: of the magnets, or of rated current in a reluctance machine."""
    load = _load_flux(machine)
    return machine.magnet_flux_wb if machine.magnet_flux_wb > RELUCTANCE * load else load


def _load_flux(machine: Machine) -> float:
    return max(machine.inductance_d_h, machine.inductance_q_h) * machine.rated_current_a


def flux_map_path(nominal: Nominal) -> Path | None:
    """The CSV file that [plant.machine] flux_map names, or None; DriveError unless it lies beside the drive file."""
    name = nominal.plant.get("machine", {}).get("flux_map")
    if not isinstance(name, str):
        return None
    where = f"{nominal.path}: [plant.machine] flux_map = {shown(name)!r}"
    folder = Path(nominal.path).parent
    try:
        path = folder / name
        if not path.resolve().is_relative_to(folder.resolve()):
            raise DriveError(f"{where} must be a CSV file in the folder of the drive file")
        if not path.is_file():
            raise DriveError(f"{where}: there is no such file in the folder of the drive file")
        if path.stat().st_size > MOST_MAP_BYTES:
            raise DriveError(f"{where} has {path.stat().st_size} bytes: allowed is up to {MOST_MAP_BYTES}")
    except (OSError, RuntimeError) as error:  # a ring of links, a name that is too long
        raise DriveError(f"{where}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    except ValueError as error:
        raise error if isinstance(error, DriveError) else DriveError(f"{where}: no file has such a name") from None
    return path


def load_nominal(path) -> Nominal:
    """The nominal drive of a TOML file; DriveError names file, section, key and what was expected."""
    sections = read_sections(path, SECTIONS)
    tables = read_tables(path)
    columns, plant = tables.get("columns", {}), tables.get("plant", {})
    if not isinstance(columns, dict):
        raise DriveError(f"{path}: columns must be a section [columns] with lines such as 'my name' = 'i_a'")
    constants = tables.get("constants", {})
    if not isinstance(constants, dict):
        raise DriveError(f"{path}: constants must be a section [constants] with lines such as i_d = 0")
    if not isinstance(plant, dict) or not all(isinstance(table, dict) for table in plant.values()):
        raise DriveError(f"{path}: plant must contain sections such as [plant.machine]")
    m = sections["machine"]
    if m.magnet_flux_wb == 0.0:  # sizes that refer to the magnets' flux stay finite, and no magnets are ever named
        small = NO_MAGNETS * _load_flux(m)
        sections["machine"] = dataclasses.replace(m, magnet_flux_wb=small)
    return Nominal(*sections.values(), columns=columns, path=str(path), plant=plant, constants=constants)
