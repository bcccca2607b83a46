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

from fluxproof.quote import shown
from golden_model import drive
from golden_model.drive_file import read_sections, read_tables
from golden_model.drive_keys import DriveError, key_of

REQUIRED = {
    "machine": (
        "pole_pairs", "resistance_ohm", "inductance_d_h", "inductance_q_h", "magnet_flux_wb", "rated_current_a",
    ),
    "inverter": ("dc_bus_v", "pwm_frequency_hz"),
}  # fmt: skip

# Ranges of drives without the core, whose formats allow less: {section: {key: (least, largest)}}.
WIDER = {"machine": {"pole_pairs": (1, 1000)}, "sensors": {"adc_bits": (1, 32), "position_bits": (1, 32)}}


def _optional(section, kind):
    """The section's dataclass in which only the required keys are mandatory, with the ranges of any drive."""
    fields, wider = [], WIDER.get(section, {})
    for f in dataclasses.fields(kind):
        needed = f.name in REQUIRED.get(section, ())
        default = dataclasses.MISSING if needed else None if f.default is dataclasses.MISSING else f.default
        key = key_of(f)
        if f.name in wider:
            key = dataclasses.replace(key, lo=wider[f.name][0], hi=wider[f.name][1])
        fields.append((f.name, f.type, dataclasses.field(default=default, metadata={"key": key})))
    fields.sort(key=lambda entry: entry[2].default is not dataclasses.MISSING)
    return dataclasses.make_dataclass(kind.__name__, fields, frozen=True)


RELUCTANCE = 0.05  # of the flux of rated current: with less the magnets do not count
NO_MAGNETS = 1e-6  # the same, in place of no flux
MOST_MAP_BYTES = 20_000_000  # of a flux map's CSV

SECTIONS = {name: _optional(name, kind) for name, kind in drive.SECTIONS.items()}


@dataclass(frozen=True)
class Nominal:
    """The sections of drive.toml as objects with the attribute names of its keys, SI units, peak values."""

    machine: object
    inverter: object
    control: object
    sensors: object
    core: object
    bases: object
    protection: object
    sampling: object
    encoder: object
    converters: object
    columns: dict = field(default_factory=dict)
    path: str = ""
    plant: dict = field(default_factory=dict)
    constants: dict = field(default_factory=dict)

    @property
    def sample_time_s(self) -> float:
        """Time between two consecutive rows [s]."""
        period = 1.0 / self.inverter.pwm_frequency_hz
        return self.control.sample_time_s or period / self.core.updates_per_period


def flux_level(machine) -> float:
    """Flux linkage [Wb] that limits the speed: of the magnets, or of rated current in a reluctance machine."""
    load = _load_flux(machine)
    return machine.magnet_flux_wb if machine.magnet_flux_wb > RELUCTANCE * load else load


def _load_flux(machine) -> float:
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
