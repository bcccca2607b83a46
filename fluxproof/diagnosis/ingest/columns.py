# SPDX-License-Identifier: BSD-3-Clause
"""Assigns file columns to canonical columns and units: by drive.toml first, then by known names.

A column that the file lacks may be a constant of drive.toml (constants.py).

[columns] of drive.toml maps a name of the file to a canonical name, as a string or as a table:

    [columns]
    "Motor current U" = "i_a"                                     # unit from the header, else SI
    "I_V"             = {name = "i_b", unit = "mA"}
    "I_W"             = {name = "i_c", factor = 0.001, offset = 0.2}   # canonical = raw * factor + offset
    "n"               = {name = "omega_e", unit = "rpm"}          # of the shaft: times the pole pairs
    "Spare"           = ""                                        # ignored

A column without a header is called by its number, "1", "2", ...  The files of several loggers may be named in one
[columns]: of the columns with one canonical name, a file has one.  Columns that [columns] does not name are found by
the exact canonical names, then by the maps of known logs in column_maps/ or, in other files, by usual_names.py.
Units are those of units.py; a shaft angle is "rad mech", a shaft speed "rpm" or "rad/s mech".
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from dataclasses import dataclass, field

import numpy as np

from fluxproof.diagnosis.column_maps import maps, plain
from fluxproof.diagnosis.ground.recording import COLUMNS, RecordingError
from fluxproof.diagnosis.ingest.demand import LINE_VOLTAGES, PHASE_VOLTAGES, is_emf_run, missing_columns
from fluxproof.diagnosis.ingest.entries import entry_of, nearest
from fluxproof.diagnosis.ingest.stated import constants_of
from fluxproof.diagnosis.ingest.units import COMMANDED, OF_BUS, conversion, known_units, split_unit
from fluxproof.diagnosis.ingest.usual_names import usual
from fluxproof.diagnosis.ingest.words import LATER, is_speed
from fluxproof.diagnosis.ingest.worth import worth
from fluxproof.diagnosis.readers.table import Table, shown

MOST_GUESSES = 6
OF_SHAFT = ("omega_e", "torque")
WORTH_NAMING = ("torque", "temp_winding", "omega_e", "u_dc")  # which a diagnosis does without if they are not found


@dataclass(frozen=True)
class Source:
    """Source of a canonical column: value = raw * factor + offset.

    stated: the unit was given explicitly; by_name: it is only what a common name ("ia") usually means; bus: the value
    is to be multiplied by the bus voltage of its row.
    """

    column: str
    factor: float = 1.0
    offset: float = 0.0
    unit: str = ""
    stated: bool = False
    by_name: bool = False
    bus: bool = False


@dataclass
class Plan:
    """{canonical name: Source}, constants for columns that a log lacks, and notes on assumptions.

    A constant of drive.toml replaces one that a ready-made map assumes.
    """

    sources: dict[str, Source] = field(default_factory=dict)
    assumed: dict[str, float] = field(default_factory=dict)
    used: str = "canonical names"
    sample_time_s: float | None = None
    run: str | None = None
    stated: list[str] = field(default_factory=list)  # names that [constants] gives
    notes: list[str] = field(default_factory=list)

    def wanted(self) -> list[str]:
        """The file columns to read."""
        names = [s.column for s in self.sources.values()] + ([self.run] if self.run else [])
        return list(dict.fromkeys(names))


def plan_columns(names: dict[str, str], nominal, path) -> Plan:
    """The plan for a file with columns ``names`` {name: unit or ""}; RecordingError lists missing columns.

    nominal: Nominal; its ``columns`` and ``machine.pole_pairs`` are used.
    """
    plan, taken = _explicit(names, nominal, path)
    left = {name: unit for name, unit in names.items() if name not in taken}
    _exact(plan, left, nominal, path)
    known = _ready_made(plan, left, nominal, path)
    if not known or missing_columns(set(plan.sources) | set(plan.assumed)):
        _usual_names(plan, left, nominal, path)
    constants = constants_of(nominal)
    for name in [name for name in constants if name in plan.sources]:
        plan.notes.append(f"[constants] {name} is not used: the recording has this column")
        del constants[name]
    plan.assumed |= constants
    plan.stated = list(constants)
    if not is_emf_run(set(plan.sources) | set(plan.assumed)):  # the commanded voltages are used
        for name in (*PHASE_VOLTAGES, *LINE_VOLTAGES):
            plan.sources.pop(name, None)
    _demand(plan, names, path)
    for source in plan.sources.values():
        if source.bus and "u_dc" not in plan.sources | plan.assumed:
            raise RecordingError(
                f"{path}: column {shown(source.column)!r} is a share of u_dc, which is missing: name its column in "
                f"[columns] of drive.toml, or give a value that was constant in [constants]"
            )
    _not_used(plan, {name: unit for name, unit in names.items() if name not in taken})
    return plan


def canonical(table: Table, plan: Plan) -> dict[str, np.ndarray]:
    """The canonical arrays (n,) of a table, converted; columns without numbers are omitted."""
    arrays = {}
    for name, source in plan.sources.items():
        raw = table.columns.get(source.column)
        if raw is not None and source.unit and source.column in table.meta.get("moments", ()):
            arrays[name] = raw  # in seconds, whatever the header says
        elif raw is not None:
            arrays[name] = raw if source.factor == 1.0 and not source.offset else raw * source.factor + source.offset
    bus = arrays.get("u_dc", plan.assumed.get("u_dc"))
    for name in [name for name in arrays if plan.sources[name].bus and bus is not None]:
        arrays[name] = arrays[name] * bus
    return arrays


def _explicit(names, nominal, path) -> tuple[Plan, set[str]]:
    """The plan of [columns], and the file columns that it uses or ignores."""
    plan, taken = Plan(), set()
    entries = {key: entry_of(key, value, nominal) for key, value in nominal.columns.items()}
    bare = {}
    for name in names:
        bare.setdefault(split_unit(name)[0], name)
    found = {key: key if key in names else bare.get(key) for key in entries}
    if not any(found.values()):
        if entries:
            plan.notes.append("none of the columns named in [columns] is in the file; [columns] was ignored")
        return plan, taken
    served = {entries[key]["name"] for key, column in found.items() if column is not None}
    for key, entry in entries.items():
        where = f"{nominal.path}: [columns] {shown(key)!r}"
        column = found[key]
        if column is None and entry["name"] in served - {""}:
            continue  # a column of another logger's files
        if column is None:
            raise RecordingError(f"{where} is not a column of {path}{nearest(key, names)}")
        taken.add(column)
        if not entry["name"]:
            continue
        if entry["name"] in plan.sources:
            raise RecordingError(
                f"{where}: {entry['name']} is already assigned to {plan.sources[entry['name']].column!r}"
            )
        unit = entry.get("unit", "")
        if "factor" in entry or "offset" in entry:
            source = Source(column, entry.get("factor", 1.0), entry.get("offset", 0.0), "", True)
        else:
            unit = unit or _unit_of(column, names) or _unit_in_name(column, entry["name"])
            source = _source(column, entry["name"], unit, nominal, where)
        plan.sources[entry["name"]] = source
        plan.used = "[columns]"
    return plan, taken


def _source(column, name, unit, nominal, where) -> Source:
    """The source of a canonical column in a unit; no unit: SI."""
    if not unit:
        return Source(column)
    if name in COMMANDED and unit in OF_BUS:
        return Source(column, OF_BUS[unit], 0.0, unit, True, bus=True)
    found = conversion(name, unit, nominal.machine.pole_pairs)
    if found is None:
        raise RecordingError(f"{where}: unit {shown(unit)!r} is unknown for {name}; known are {known_units(name)}")
    return Source(column, *found, unit, True)


def _unit_of(column, names) -> str:
    """The unit of a column in the file: from its header or from a field of the format."""
    return names.get(column, "").strip() or split_unit(column)[1]


def _unit_in_name(column, canonical_name) -> str:
    """The unit at the end of a usual name of this signal, such as "omega_e_rad_s"; "" where there is none."""
    named = usual(column, "")
    return named[1] if named and named[0] == canonical_name else ""


def _exact(plan, left, nominal, path) -> None:
    """Assign columns with canonical names, with or without a unit."""
    for column in left:
        name = split_unit(column)[0]
        if name in COLUMNS and name not in plan.sources:
            unit = _unit_of(column, left)
            plan.sources[name] = _source(column, name, unit, nominal, f"{path}: column {shown(column)!r}")


def _ready_made(plan, left, nominal, path) -> bool:
    """Fill missing columns from the map of a known log that knows most of the file's columns; whether there is one."""
    best, hits = None, {}
    for known in maps():
        key = getattr(known, "KEY", plain)
        keys: dict[str, list[str]] = {}
        for column in left:
            keys.setdefault(key(split_unit(column)[0]), []).append(column)
        if known.SIGNATURE <= set(keys):
            fits = {k: c for k, c in keys.items() if k in known.COLUMNS and known.COLUMNS[k][0] not in plan.sources}
            if (len(known.SIGNATURE), len(fits)) > (len(best.SIGNATURE), len(hits)) if best else fits:
                best, hits = known, fits
    if best is None or not hits:
        return False
    _ignore(plan, best, left)
    for key, columns in hits.items():
        name, unit = best.COLUMNS[key]
        if len(columns) > 1:
            raise _doubtful(path, columns, name)
        if name not in plan.sources:
            where = f"{path}: column {shown(columns[0])!r}"
            stated = _unit_of(columns[0], left)
            if key in getattr(best, "SHAFT", ()) and conversion(name, f"{stated} mech", 1) is not None:
                stated += " mech"
            plan.sources[name] = _source(columns[0], name, stated or unit, nominal, where)
    plan.used = f"{plan.used}, {best.NAME}" if plan.used == "[columns]" else best.NAME
    plan.notes += [f"column names as in {best.NAME}", *getattr(best, "NOTES", [])]
    plan.assumed |= {k: v for k, v in getattr(best, "ASSUMED", {}).items() if k not in plan.sources}
    plan.sample_time_s = getattr(best, "SAMPLE_TIME_S", None)
    plan.run = next((c for c in left if c == getattr(best, "RUN", None)), None)
    return True


def _ignore(plan, known, left) -> None:
    """Leave out what has a canonical name and is something else in a known log."""
    key = getattr(known, "KEY", plain)
    for column in left:
        why = getattr(known, "IGNORED", {}).get(key(split_unit(column)[0]))
        for name in [name for name, source in plan.sources.items() if why and source.column == column]:
            del plan.sources[name]
        if why:
            plan.notes.append(f"{known.NAME}: column {shown(column)!r} is not used: {why}")


def _usual_names(plan, left, nominal, path) -> None:
    """Fill missing columns by the usual names of signals, and note which were found so."""
    found: dict[str, list[tuple[int, str, str]]] = {}
    for column in left:
        named = usual(column, left[column].strip())
        if named and named[0] not in plan.sources:
            found.setdefault(named[0], []).append((named[2], column, named[1]))
    doubts = {}
    for name, candidates in found.items():
        (rank, column, unit), *others = sorted(candidates)
        if others and others[0][0] == rank:
            doubts[name] = _doubtful(path, [column, others[0][1]], name)
            if rank < LATER:
                raise doubts[name]
            plan.notes.append(f"{shown(column)!r} and {shown(others[0][1])!r} could both be {name}: none is used")
            continue
        source = _source(column, name, unit or COLUMNS[name], nominal, f"{path}: column {shown(column)!r}")
        plan.sources[name] = dataclasses.replace(source, by_name=not unit)
    if doubts and missing_columns(set(plan.sources) | set(plan.assumed) | set(constants_of(nominal))):
        raise next(iter(doubts.values()))
    if read := [name for name in found if name not in doubts]:
        text = ", ".join(f"{name} from {shown(plan.sources[name].column)!r}" for name in read)
        plan.notes.append(f"columns read by their usual names: {text}; override them in [columns]")
    if any(re.search(r"\boutput\b", plan.sources[name].column, re.I) for name in read if name in OF_SHAFT):
        plan.notes.append("torque and speed of the output are taken as the motor's: with a gear, divide by its ratio")


def _doubtful(path, columns, name) -> RecordingError:
    return RecordingError(
        f"{path}: {shown(columns[0])!r} and {shown(columns[1])!r} could both be {name}; choose one in [columns]"
    )


def _demand(plan, names, path) -> None:
    """Check the columns that a balance requires; RecordingError lists the missing and the present ones."""
    missing = missing_columns(set(plan.sources) | set(plan.assumed))
    if missing:
        found = ", ".join(shown(name, 24) for name in list(names)[:16]) + (", ..." if len(names) > 16 else "")
        why = f" ({plan.notes[-1]})" if plan.notes else ""
        raise RecordingError(
            f"{path}: missing {' and '.join(missing)}; found columns {found or 'none'}{_guesses(missing, names)}; "
            f"name them by --column NAME=... or in [columns] of drive.toml, or give a value that was constant in "
            f"[constants]{why}"
            f"{worth(missing, names, set(plan.sources) | set(plan.assumed), plan.wanted())}"
        )


def _not_used(plan, left) -> None:
    """Note a column that is not used though its unit is that of a quantity which the recording lacks."""
    used = plan.wanted()
    for name in WORTH_NAMING:
        if name in plan.sources or name in plan.assumed:
            continue
        for column in left:
            unit, known = _unit_of(column, left), split_unit(column)[0] in COLUMNS
            if unit and not known and column not in used and conversion(name, unit, 1) is not None:
                plan.notes.append(f"column {shown(column)!r} is not used; if it is {name}, assign it in [columns]")


def _guesses(missing, names) -> str:
    """File columns that may be the missing ones."""
    wanted = [w for w in COLUMNS if any(w in re.findall(r"\w+", text) for text in missing)]
    simple = {name.lower().replace("_", ""): name for name in names if split_unit(name)[0] not in COLUMNS}
    close = {w: difflib.get_close_matches(w.replace("_", ""), list(simple), n=1, cutoff=0.6) for w in wanted}
    likely = {w: simple[match[0]] for w, match in close.items() if match}
    nearly = _nearly_usual(names)
    if found := {w: nearly[w] for w in wanted if w in nearly}:
        likely = found | {w: column for w, column in likely.items() if column not in found.values() and w == "omega_e"}
    pairs = [f"{shown(column, 24)!r} for {w}{_with_unit(w)}" for w, column in likely.items()]
    return f"; perhaps {', '.join(pairs[: MOST_GUESSES if found else 3])}" if pairs else ""


def _nearly_usual(names) -> dict[str, str]:
    """{canonical name: column} of usual names that count only with a unit, such as "n", or lack a number: "vd1"."""
    out: dict[str, str] = {}
    for name in names:
        if is_speed(name):
            out.setdefault("omega_e", name)
        found = re.fullmatch(r"(.*[^\d_])_?\d", split_unit(name)[0])
        known = usual(found.group(1), "") if found else None
        if known:
            out.setdefault(known[0], name)
    return out


def _with_unit(name) -> str:
    """What a proposal for a column must say of its unit: an undocumented speed may be of the shaft, or in rpm."""
    return f" if its unit is stated, {{name = {name!r}, unit = 'rpm'}} or 'rad/s'" if name == "omega_e" else ""
