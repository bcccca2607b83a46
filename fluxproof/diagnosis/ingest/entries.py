# SPDX-License-Identifier: BSD-3-Clause
"""One entry of [columns] of a drive.toml, checked, or of the option --column that adds one."""

from __future__ import annotations

import difflib

from fluxproof.diagnosis.ground.recording import COLUMNS, RecordingError
from fluxproof.diagnosis.ingest.units import split_unit
from fluxproof.quote import shown
from golden_model.drive_keys import is_finite

KEYS = {"name", "unit", "factor", "offset"}


def entry_of(key, value, nominal) -> dict:
    """One line of [columns] as a validated table."""
    where = f"{nominal.path}: [columns] {shown(key)!r}"
    entry = {"name": value} if isinstance(value, str) else value
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
        raise RecordingError(f"{where}: must be a canonical name or a table such as {{name = 'i_a', unit = 'mA'}}")
    if entry["name"] and entry["name"] not in COLUMNS:
        raise RecordingError(
            f"{where}: {shown(entry['name'])!r} is not a canonical name{nearest(entry['name'], COLUMNS)}"
        )
    for name in entry:
        if name not in KEYS:
            raise RecordingError(f"{where}: unknown key {shown(name)!r}; known are name, unit, factor, offset")
    for name in ("factor", "offset"):
        if not is_finite(entry.get(name, 1.0)):
            raise RecordingError(f"{where}: {name} must be a finite number")
    if entry.get("factor") == 0:
        raise RecordingError(f"{where}: factor must not be 0")
    if not isinstance(entry.get("unit", ""), str) or ("unit" in entry and ("factor" in entry or "offset" in entry)):
        raise RecordingError(f"{where}: give either unit, as a string, or factor and offset")
    return entry


def entries_of(options) -> dict:
    """Entries of [columns] of the texts "NAME=CANONICAL" or "NAME=CANONICAL [UNIT]" of --column."""
    out = {}
    for text in options or ():
        key, _, told = (part.strip() for part in text.rpartition("="))
        name, unit = split_unit(told)
        if not key or name not in (*COLUMNS, ""):
            expected = "expected NAME=CANONICAL, such as 'Dev1_ai0=u_ab' or 'n=omega_e [rpm]'"
            known = nearest(name, COLUMNS) if key else ""
            raise RecordingError(f"--column {shown(text)!r}: {expected}{known}")
        out[key] = {"name": name, "unit": unit} if unit else name
    return out


def nearest(name, known) -> str:
    """The known name that is most like ``name``, as the end of a message."""
    close = difflib.get_close_matches(name, list(known), n=1, cutoff=0.0)
    return f"; the nearest is {shown(close[0])!r}" if close else ""
