# SPDX-License-Identifier: BSD-3-Clause
"""Load a file as a checked canonical recording: read, map the columns, check.

    recording = load_recording("log.csv", load_nominal("drive.toml"))

RecordingError: the file is unusable; the message is one line.  A recording that can be read but not diagnosed has a
fatal problem.  ``meta`` of the recording contains "notes" (assumptions and harmless corrections), "columns"
(canonical name: file column) and "map" (the map that was used).  Rows of a ``slow`` recording are joined if they are
one step of the log apart.  Rows without a time that cannot follow each other are operating points (points.py); the
terminal voltages of a machine without current become rows of a control period (emf.py).
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.checks import check_recording
from fluxproof.diagnosis.checks.missing import OPTIONAL
from fluxproof.diagnosis.conventions.restated import alternatives
from fluxproof.diagnosis.ground.recording import Recording, RecordingError
from fluxproof.diagnosis.ingest.analyser import dq_of_analyser
from fluxproof.diagnosis.ingest.columns import Plan, canonical, plan_columns
from fluxproof.diagnosis.ingest.demand import is_emf_run
from fluxproof.diagnosis.ingest.dyno import dq_of_dyno
from fluxproof.diagnosis.ingest.emf import emf_rows
from fluxproof.diagnosis.ingest.points import as_table, is_table
from fluxproof.diagnosis.ingest.units import conversion
from fluxproof.diagnosis.loading.reread import doubtful, fits
from fluxproof.diagnosis.readers import read_table
from fluxproof.diagnosis.readers.table import Table, shown


def load_recording(path, nominal, *beside) -> Recording:
    """The checked recording of a file in canonical form; RecordingError for unusable input.

    path: a file in any format of diagnosis/readers; nominal: Nominal, with its [columns]; beside: further files of the
    same matrices (together.py).
    """
    recording = _checked(Path(path), nominal, *beside)
    if doubtful(recording):
        for restated in alternatives(recording, nominal):
            other = _checked(Path(path), restated.of(nominal), *beside)
            if fits(other, restated.of(nominal), restated):
                other.meta["restated"] = restated
                return other
    return recording


def _checked(path: Path, nominal, *beside) -> Recording:
    """The recording of a file after all checks."""
    plans: list[Plan] = []

    def select(names: dict[str, str]) -> list[str]:
        plans.append(plan_columns(names, nominal, path))
        return plans[-1].wanted()

    table = read_table(path, select, *beside)
    recording = _recording(path, table, plans[-1], nominal)
    check_recording(recording, nominal)
    return recording


def _recording(path, table: Table, plan: Plan, nominal) -> Recording:
    """Canonical columns with a time, all rows usable, not yet checked."""
    columns = canonical(table, plan)
    text = {name: s.column for name, s in plan.sources.items() if name not in columns}
    lost = [name for name in text if name not in OPTIONAL]
    if lost:
        name, column = lost[0], text[lost[0]]
        line = f":{table.lines[0]}" if table.lines is not None else ""
        raise RecordingError(f"{path}{line}: column {shown(column)!r} ({name}) contains no numbers")
    n = len(next(iter(columns.values())))
    notes = [*table.notes, *plan.notes]
    notes += [f"{name}: column {shown(column)!r} contains no numbers and is ignored" for name, column in text.items()]
    meta = table.meta | {
        "notes": notes,
        "map": plan.used,
        "columns": {k: s.column for k, s in plan.sources.items()},
    }
    meta["column_scales"] = {k: (s.factor, s.offset) for k, s in plan.sources.items()}
    meta["of_bus"] = [name for name, s in plan.sources.items() if s.bus]
    meta["stated_units"] = [name for name, s in plan.sources.items() if s.stated]
    meta["documented_units"] = [name for name in meta["stated_units"] if not plan.sources[name].by_name]
    meta["of_shaft"] = [name for name, s in plan.sources.items() if _of_shaft(name, s.unit)]
    for name, value in plan.assumed.items():
        columns[name] = np.full(n, value)
    notes += [f"{name} = {plan.assumed[name]:g} by [constants] of the drive file" for name in plan.stated]
    columns = dq_of_analyser(path, columns, nominal, notes)
    columns, lacks = dq_of_dyno(columns, nominal, notes)
    if is_emf_run(columns):
        return emf_rows(path, columns, nominal, meta)
    if "t" in columns and n > 1 and np.ptp(columns["t"]) == 0.0:  # a date with too few digits, an unused counter
        notes.append(f"column {shown(meta['columns'].get('t', 't'))!r} is the same in all rows and tells no time")
        del columns["t"]
    timeless = ("t" not in columns or n == 1) and not table.meta.get("sample_time_s") and not plan.sample_time_s
    if timeless and is_table(columns, nominal):
        return as_table(path, columns, meta, table.problems, lacks)
    if "t" not in columns:
        known = table.meta.get("sample_time_s") or plan.sample_time_s
        step = known or nominal.sample_time_s
        if not known:
            meta["assumed_step_s"] = step
        columns["t"] = step * np.arange(n)
        notes.append(f"no time column: rows are assumed to be {step:g} s apart")
    if plan.run and plan.run in table.columns:
        meta["run"] = table.columns[plan.run]
    if table.lines is not None:
        meta["lines"] = table.lines
    recording = Recording(
        str(path), columns, np.ones(n, bool), np.append(np.ones(n - 1, bool), False), meta=meta, lacks=lacks
    )
    recording.problems += [_renamed(problem, meta["columns"]) for problem in table.problems]
    return recording


def _of_shaft(name, unit) -> bool:
    """Whether the pole pairs are in the conversion of a unit."""
    return bool(unit) and conversion(name, unit, 1) != conversion(name, unit, 2)


def _renamed(problem, columns):
    """A reader's finding with the canonical name of its column."""
    name = next((k for k, column in columns.items() if column == problem.column), problem.column)
    return dataclasses.replace(problem, column=name)
