# SPDX-License-Identifier: BSD-3-Clause
"""Columns that a recording lacks because they were constant: section [constants] of drive.toml.

    [constants]
    omega_e = 314.16                              # canonical name = value in SI units
    u_dc = 48
    i_d = 0
    "omega_e" = {value = 3000, unit = "rpm"}      # or with a unit, as in [columns]

They apply to every recording that is diagnosed with this drive file and does not have the column.
"""

from __future__ import annotations

import difflib

from fluxproof.diagnosis.ground.recording import COLUMNS, RecordingError
from fluxproof.diagnosis.ingest.units import conversion, known_units
from fluxproof.quote import shown
from golden_model.drive_keys import RANGES, is_finite

MEASURED = ("t", "u_a", "u_b", "u_c", "u_ab", "u_bc", "u_ca", "fault", "enable")  # a constant would state nothing


def constants_of(nominal) -> dict[str, float]:
    """{canonical name: value in SI units} of [constants]; RecordingError names the entry and what is allowed."""
    return {name: _value(name, value, nominal) for name, value in nominal.constants.items()}


def _value(name, value, nominal) -> float:
    where = f"{nominal.path}: [constants] {shown(name)}"
    known = [column for column in COLUMNS if column not in MEASURED]
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
        raise RecordingError(f"{where} is not a canonical name that can be constant; the nearest is {close[0]!r}")
    unit = ""
    if isinstance(value, dict):
        if not {"value"} <= set(value) <= {"value", "unit"} or not isinstance(value.get("unit", ""), str):
            raise RecordingError(f"{where}: must be a number or a table such as {{value = 3000, unit = 'rpm'}}")
        value, unit = value["value"], value.get("unit", "")
    if not is_finite(value):
        raise RecordingError(f"{where}: must be a finite number, or {{value = 3000, unit = 'rpm'}}")
    found = conversion(name, unit, nominal.machine.pole_pairs) if unit else (1.0, 0.0)
    if found is None:
        raise RecordingError(f"{where}: unit {shown(unit)!r} is unknown for {name}; known are {known_units(name)}")
    value, most = float(value) * found[0] + found[1], RANGES[COLUMNS[name]][1]
    if abs(value) > most:
        raise RecordingError(f"{where} = {value:g} is out of range: allowed is up to {most:g} {COLUMNS[name]}")
    return value
