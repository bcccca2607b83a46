# SPDX-License-Identifier: BSD-3-Clause
"""Readings applied to a drive, a recording and a drive file."""

from __future__ import annotations

import dataclasses
import math

import tomlkit

from fluxproof.diagnosis.ground.recording import Recording
from fluxproof.diagnosis.ingest.units import OF_BUS
from fluxproof.quote import toml_comment, toml_key
from golden_model.drive_keys import DriveError


def read_drive(nominal, readings):
    """The drive with the values that the readings restore."""
    for reading in readings:
        nominal = reading.of(nominal)
    return nominal


def read_recording(recording: Recording, readings) -> Recording:
    """The recording with the columns that the readings restore."""
    columns = dict(recording.columns)
    for reading in readings:
        for name, (factor, offset) in reading.columns().items():
            if name in columns:
                columns[name] = columns[name] * factor + offset
        if reading.speed != 1.0:  # in a drive file the pole pairs do that
            columns["omega_e"] = columns["omega_e"] * reading.speed
    return dataclasses.replace(recording, columns=columns)


def edit(document, nominal, readings, recording, put) -> None:
    """Write what the readings restore to a drive file: keys, and factors in [columns].

    document: tomlkit; recording: whose columns the file describes, or None; put: function (table, key, value, why).
    A column whose unit a check has converted stays as it is, as the file does not state that unit; but where its values
    gave the unit away (checks/sizes.py), the factor holds that unit too.
    """
    for reading in readings:
        for section, key, value in reading.keys(nominal):
            put(document.setdefault(section, tomlkit.table()), key, value, reading.says)
        nominal = reading.of(nominal)
    if recording is None:
        return
    converted = {p.column for p in recording.problems if p.action in ("converted", "corrected")}
    converted -= set(recording.meta.get("rescaled", ()))
    sources, scales = recording.meta.get("columns", {}), recording.meta.get("column_scales", {})
    for name in sources:
        factor, offset = scales.get(name, (1.0, 0.0))
        why = []
        for reading in readings:
            if name in reading.columns():
                f, o = reading.columns()[name]
                factor, offset = factor * f, offset * f + o
                why.append(reading.says)
        written = _written(factor, offset, name in recording.meta.get("of_bus", ()))
        if why and written and name not in converted:
            entry = tomlkit.inline_table()
            entry.update({"name": name} | written)
            table = document.setdefault("columns", tomlkit.table())
            try:
                put(table, toml_key(sources[name]), entry, "; ".join(why))
            except DriveError as error:  # the other values of the file are as good without this one
                table.add(tomlkit.comment(toml_comment(f"{error}; it is {entry.as_string()}")))


def _written(factor, offset, of_bus) -> dict:
    """Factor and offset of a column as keys of its entry; of_bus: it is a share of the bus voltage, whose unit says it.

    {} if no unit of a modulation index is such a share: the entry then stays as it is.
    """
    if of_bus:
        return next(({"unit": unit} for unit, share in OF_BUS.items() if math.isclose(share, factor)), {})
    return {"factor": _digits(factor)} | ({"offset": _digits(offset)} if offset else {})


def _digits(value) -> float:
    return float(f"{value:.9g}")
