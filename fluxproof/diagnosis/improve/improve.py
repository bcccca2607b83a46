# SPDX-License-Identifier: BSD-3-Clause
"""drive_improved.toml: the nominal drive file with the identified effects.

The file keeps the text of the original; a changed line states the old value and the effect.  Values for which the
core's own sections have a key go there, so that ``fluxproof registers`` computes the improved registers; the others go
to [plant.*], which only the plant reads (ground/plant_section.py).  A sensor error appears in [plant.sensors] as a
property of the hardware, and in [sensors] as the trim that cancels it.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import tomlkit
from tomlkit.items import AbstractTable, Array

from fluxproof.diagnosis.conventions.apply import edit, read_drive
from fluxproof.diagnosis.effects import is_usual
from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.diagnosis.ground.plant_section import Plant, Timing, described_sensors, merged, plant_of
from fluxproof.diagnosis.ground.result import NamedEffect
from fluxproof.diagnosis.improve.improved_core import CoreValue, core_changes, core_values
from fluxproof.files import write_text
from fluxproof.plant import FluxMap, Harmonic
from fluxproof.quote import toml_comment
from golden_model import drive as drives
from golden_model.drive_file import read_text

__all__ = ["CoreValue", "Plant", "Timing", "core_values", "improved_toml", "plant_of", "write_improved"]

DIGITS = 9  # significant digits in the file: more than any estimate has, and still legible


def improved_toml(nominal: Nominal, effects: list[NamedEffect], readings=(), recording=None) -> str:
    """The text of the improved drive file; ValueError for an unknown plant key.

    readings: how drive file and recording are to be read (conventions/); recording: whose columns are then described.
    """
    by_name = {effect.name: effect for effect in effects}
    document = _original(nominal)
    edit(document, nominal, readings, recording, _set)
    nominal = read_drive(nominal, readings)
    changes = core_changes(nominal, effects)
    for change in changes:
        why = "; ".join(_words(by_name[name]) for name in change.why.split(" and "))
        _set(document.setdefault(change.section, tomlkit.table()), change.key, change.value, why)
    changed = {f"{change.section}.{change.key}" for change in changes}
    for key, (value, names) in merged(effects).items():
        section, name = key.split(".", 1)
        if key in changed:
            document.get("plant", {}).get(section, {}).pop(name, None)  # it would override the new value
        else:
            plant = document.setdefault("plant", tomlkit.table(is_super_table=True))
            table = plant.setdefault(section, tomlkit.table())
            _set(table, name, _absolute(nominal, key, value), "; ".join(_words(by_name[n]) for n in names))
    return tomlkit.dumps(document)


def to_write(nominal: Nominal, effects, catalogue) -> list[NamedEffect]:
    """The effects whose values belong into a drive file: none of an implausible size, which would only hide its cause.

    catalogue: {name: Effect}.
    """
    plausible = {e.name: catalogue[e.name].plausible if e.name in catalogue else {} for e in effects}
    return [e for e in effects if is_usual(e.parameters, plausible[e.name], nominal)]


def write_improved(nominal: Nominal, effects: list[NamedEffect], path, readings=(), recording=None) -> Path:
    """Write ``improved_toml`` atomically to ``path``; returns the path."""
    return write_text(Path(path), improved_toml(nominal, effects, readings, recording))


def _original(nominal: Nominal):
    """The nominal file as a TOML document with its comments; a new document of its values if there is no file."""
    if nominal.path and Path(nominal.path).is_file():
        return tomlkit.parse(read_text(nominal.path))
    document = tomlkit.document()
    for name, kind in drives.SECTIONS.items():
        given = {k: _toml(v) for k, v in vars(getattr(nominal, name)).items() if v is not None}
        defaults = {f.name: f.default for f in dataclasses.fields(kind)}
        given = {k: v for k, v in given.items() if v != _toml(defaults[k])}
        if given:
            document[name] = given
    for name in ("columns", "constants", "plant"):
        if getattr(nominal, name):
            document[name] = getattr(nominal, name)
    return document


def _set(table, key, value, why):
    """Set one key with a comment: the old value, the effect, and the original comment."""
    old, note = table.get(key), ""
    if hasattr(old, "trivia"):
        note = old.trivia.comment.lstrip("# ")
    words = [why] if old is None else [f"was {_shown(old)}", why]
    item = tomlkit.item(_toml(value))
    for part in item.values() if isinstance(item, AbstractTable) else [item]:
        if isinstance(part, Array) and any(isinstance(row, list) for row in part.unwrap()):
            part.multiline(True)  # one line per row of the matrix
    if not isinstance(item, AbstractTable):
        item.comment(toml_comment("; ".join([*words, *([note] if note else [])])))
    else:
        item.comment(toml_comment(why))
    table[key] = item


def _shown(old) -> str:
    text = " ".join(tomlkit.item(old).as_string().split())
    return text if len(text) <= 60 else f"{text[:57]}..."


def _words(effect: NamedEffect) -> str:
    """The effect with its first parameters, short enough for a comment."""
    found = [f"{k} {e.value:.4g} +- {e.sigma:.1g} {e.unit}" for k, e in list(effect.parameters.items())[:3]]
    return f"{effect.name}: {', '.join(found)}" if found else effect.name


def _toml(value):
    """Plain Python for TOML: numbers rounded to DIGITS, no tuples, arrays or objects."""
    if isinstance(value, FluxMap):
        return {f.name: _toml(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Harmonic):
        return _toml(dataclasses.astuple(value))
    if isinstance(value, (tuple, list, np.ndarray)):
        return [_toml(v) for v in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    return float(f"{float(value):.{DIGITS}g}") if isinstance(value, (float, np.floating)) else value


def _absolute(nominal: Nominal, key: str, value):
    """A sensor error as a property of the hardware: effects describe readings after the nominal trims."""
    section, name = key.split(".", 1)
    if section != "sensors":
        return value
    s, assumed, p = nominal.sensors, described_sensors(nominal), nominal.machine.pole_pairs
    if name == "current_gain_error":
        return tuple((1.0 + e) / trim - 1.0 for e, trim in zip(value, s.current_gain, strict=True))
    if name == "current_offset_a":
        return tuple(a + o / t for a, o, t in zip(assumed[name], value, s.current_gain, strict=True))
    if name == "u_dc_gain_error":
        return (1.0 + value) / s.u_dc_gain - 1.0
    turning = assumed["position_direction"]
    if name == "position_offset_rad":
        return turning * (value - s.theta_offset_rad / p)
    return turning * value if name in ("eccentricity_once_rad", "eccentricity_twice_rad") else value
