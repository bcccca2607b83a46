# SPDX-License-Identifier: BSD-3-Clause
"""The keys of the plant by section, their values from an effect or from [plant.*] of a drive file, and the flux map.

The names are those of plant.Machine, plant.Inverter, plant.Sensors and of Timing and Hil below.  Where a section of the
core has the same key, its range applies; the others have the range of their unit (drive_keys.RANGES).
"""

from __future__ import annotations

import dataclasses
import difflib
import io
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from fluxproof.diagnosis.ground.nominal import MOST_MAP_BYTES, Nominal
from fluxproof.diagnosis.ground.nominal import SECTIONS as CORE
from fluxproof.plant import FluxMap, Harmonic, Inverter, Machine, Sensors
from fluxproof.quote import shown
from golden_model.drive_keys import RANGES, DriveError, Key, is_finite, key_of
from golden_model.regular_file import read_regular

HARMONICS, FLUX_MAP = "machine.emf_harmonics", "machine.flux_map"
MOST_HARMONICS, MOST_POINTS = 1000, 100_000  # of a file


@dataclass(frozen=True)
class Timing:
    """Deviations in time from the nominal drive [s].

    delay_s: the voltage acts this much later than duty_applied_after_samples says.
    sampling_skew_s: the currents are sampled this long after the PWM centre; negative: before it.
    angle_delay_s: the measured angle is this old, from a filter, an observer or an older message.
    """

    delay_s: float = 0.0
    sampling_skew_s: float = 0.0
    angle_delay_s: float = 0.0


@dataclass(frozen=True)
class Hil:
    """What the motor in the FPGA has and the plant does not; zeros: nothing of it.

    current_filter_s: time constant of a filter in front of the current converters.
    winding_j_per_k, winding_s, magnet_s: heat capacity of the winding, its time constant to the ambient, that of the
    magnets to the winding.  They warm from temperature_winding_c of [plant.machine], which is the ambient's.
    """

    current_filter_s: float = 0.0
    winding_j_per_k: float = 0.0
    winding_s: float = 0.0
    magnet_s: float = 0.0


SECTIONS = {"machine": Machine, "inverter": Inverter, "sensors": Sensors, "timing": Timing, "hil": Hil}
KEYS = {f"{name}.{f.name}": f for name, kind in SECTIONS.items() for f in dataclasses.fields(kind)}
UNITS = {"a": "A", "v": "V", "s": "s", "rad": "rad", "nm": "Nm"}  # by the end of a key's name
OWN = {  # ranges that are neither the core's nor those of a unit
    **{f"sensors.{name}_bits": Key("int", lo=8, hi=24) for name in ("current", "u_dc", "position")},
    "sensors.current_full_scale_a": Key("float", "A", *RANGES["A"]),
    "sensors.u_dc_full_scale_v": Key("float", "V", *RANGES["V"]),
    "sensors.current_noise_a": Key("float", "A", 0.0, RANGES["A"][1]),
    "sensors.u_dc_noise_v": Key("float", "V", 0.0, RANGES["V"][1]),
    "sensors.position_noise_rad": Key("float", "rad", 0.0, RANGES["rad"][1]),
    "sensors.position_direction": Key("int", lo=-1, hi=1, least=1.0),
    "sensors.position_counts": Key("int", lo=0, hi=1 << 24),
    "sensors.position_pole_pairs": Key("int", lo=1, hi=63),
    "sensors.seed": Key("int", lo=0, hi=(1 << 63) - 1),
    "machine.cogging_order": Key("int", lo=0, hi=100_000),
    "machine.shorted_share": Key("float", "1", 0.0, 0.9),
    "machine.shorted_phase": Key("int", lo=0, hi=2),
    **{f"hil.{name}": Key("float", "s", 0.0, RANGES["s"][1]) for name in ("current_filter_s", "winding_s", "magnet_s")},
    "hil.winding_j_per_k": Key("float", "J/K", 0.0, RANGES["W"][1]),
}


def check_key(key: str) -> None:
    """Raise ValueError for an unknown plant key, with the nearest known one."""
    if key not in KEYS:
        near = difflib.get_close_matches(key[:100], KEYS, n=1, cutoff=0.0)[0]
        raise ValueError(f"{shown(key)} is not a key of the plant; the nearest known one is {near}")


def plain(key: str, value) -> Any:
    """A value of TOML or of an effect in the type of the plant's field; ValueError for a wrong value."""
    check_key(key)
    if key == HARMONICS:
        return tuple(h if isinstance(h, Harmonic) else _harmonic(h) for h in _listed(key, value))
    if key == FLUX_MAP:
        return value if value is None or isinstance(value, FluxMap) else _flux_map(value)
    several = isinstance(value, (list, tuple, np.ndarray))
    if several != isinstance(KEYS[key].default, tuple):
        raise ValueError(f"{key} needs {'one number' if several else 'three values, phases a, b, c'}")
    if not several:
        return _number(key, value)
    if len(value) != 3:
        raise ValueError(f"{key} needs three values, phases a, b, c, not {len(value)}")
    return tuple(float(_number(key, v)) for v in value)


def plant_given(nominal: Nominal) -> dict[str, dict]:
    """{section: {key: value}} of [plant.*] but a flux map by name; DriveError names key and range of a wrong value."""
    for name in nominal.plant:
        if name not in SECTIONS:
            raise DriveError(f"{nominal.path}: unknown section [plant.{shown(name)}]; known are {', '.join(SECTIONS)}")
    given = {name: {} for name in SECTIONS}
    for section, table in nominal.plant.items():
        for name, value in table.items():
            key = f"{section}.{name}"
            if key == FLUX_MAP and isinstance(value, str):
                continue
            try:
                given[section][name] = _in_range(key, plain(key, value))
            except (TypeError, ValueError) as error:
                raise DriveError(f"{nominal.path}: [plant] {error}") from None
    return given


def read_flux_map(path) -> FluxMap:
    """A CSV with i_d_a, i_q_a, psi_d_wb, psi_q_wb (flux_found.py); ValueError names the file if it is none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)  # numpy only warns of a file without rows
            # As text: numpy would unpack or fetch what only has the name of a file.
            text = io.StringIO(read_regular(path, MOST_MAP_BYTES).decode("utf-8-sig"))
            rows = np.loadtxt(text, delimiter=",", skiprows=1, ndmin=2, max_rows=MOST_POINTS + 1)
        if rows.shape[1] != 4 or len(rows) > MOST_POINTS:
            found = f"{rows.shape[1]} columns and {len(rows)} rows"
            raise ValueError(f"expected four columns and up to {MOST_POINTS} rows, found {found}")
        return _bounded(FluxMap.from_points(*rows.T))
    except (OSError, TypeError, ValueError, UserWarning) as error:
        raise ValueError(f"flux_map {path}: {shown(error, 200)}") from None


def _number(key: str, value):
    """A finite number, whole where the plant needs a whole one."""
    value = value.item() if isinstance(value, np.generic) else value
    if not is_finite(value):
        raise ValueError(f"{key} = {shown(_words(value))} must be a finite number")
    if KEYS[key].type not in ("int", int):
        return value
    if value != int(value):
        raise ValueError(f"{key} = {value!r} must be a whole number")
    return int(value)


def _words(value) -> str:
    """The value for a message; Python writes no number of more than 4300 digits."""
    try:
        return repr(value)
    except (RecursionError, ValueError):
        return f"this {type(value).__name__}"


def _listed(key: str, value):
    if not isinstance(value, (list, tuple)) or len(value) > MOST_HARMONICS:
        raise ValueError(f"{key} needs a list of up to {MOST_HARMONICS} harmonics")
    return value


def _harmonic(row) -> Harmonic:
    """[order, amplitude_d, amplitude_q, phase_rad], of which the later ones may be missing."""
    if not isinstance(row, (list, tuple)) or not 1 <= len(row) <= 4 or not all(map(is_finite, row)):
        raise ValueError(f"{HARMONICS}: a harmonic is [order, amplitude_d, amplitude_q, phase_rad], finite numbers")
    if max(abs(float(number)) for number in row) > RANGES["1"][1]:
        raise ValueError(f"{HARMONICS}: a number of a harmonic is up to {RANGES['1'][1]:g}")
    return Harmonic(*map(float, row))


def _flux_map(table) -> FluxMap:
    """A map from a table of TOML."""
    names = [f.name for f in dataclasses.fields(FluxMap)]
    if not isinstance(table, dict) or set(table) != set(names):
        raise ValueError(f"{FLUX_MAP} needs the name of a CSV file, or a table of {', '.join(names)}")
    try:
        grids = {name: np.asarray(grid) for name, grid in table.items()}
    except ValueError:  # rows of different lengths
        grids = {}
    shapes = [grid.ndim if grid.dtype.kind in "if" else 0 for grid in grids.values()]
    if sorted(shapes) != [1, 1, 2, 2] or max(grid.size for grid in grids.values()) > MOST_POINTS:
        raise ValueError(f"{FLUX_MAP}: currents are lists, flux linkages of lists, up to {MOST_POINTS} numbers")
    return _bounded(FluxMap(**{name: grid.astype(float) for name, grid in grids.items()}))


def _bounded(chart: FluxMap) -> FluxMap:
    """The map, if its numbers are those of a machine; ValueError otherwise."""
    for field in dataclasses.fields(chart):
        most = RANGES["A" if field.name.endswith("_a") else "Wb"][1]
        if not np.abs(getattr(chart, field.name)).max() <= most:
            raise ValueError(f"{FLUX_MAP}: a number of {field.name} is not finite, or above {most:g}")
    return chart


def _in_range(key: str, value):
    """The value, if it is within the range of its key; zero is the absence of an effect."""
    if key in (HARMONICS, FLUX_MAP):
        return value
    allowed = _range_of(key)
    for number in value if isinstance(value, tuple) else (value,):
        if not allowed.accepts(number) and (number != 0 or key in OWN):
            raise ValueError(f"{key} = {number:g} is out of range: allowed is {allowed.allowed}")
    return value


def _range_of(key: str) -> Key:
    """The range of a key of the plant."""
    section, name = key.split(".", 1)
    if key in OWN:
        return OWN[key]
    if section in CORE:
        for field in dataclasses.fields(CORE[section]):
            if field.name == name:
                return key_of(field)
    unit = UNITS.get(name.rsplit("_", 1)[-1], "1")
    return Key("float", unit, -RANGES[unit][1], RANGES[unit][1])
