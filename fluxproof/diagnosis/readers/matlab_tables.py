# SPDX-License-Identifier: BSD-3-Clause
"""Tables and timetables of a .mat file, which MATLAB stores as objects of classes; read with mat-io.

The library gives the stored properties of an object and turns those of a table into a pandas table; it constructs
nothing that a file names.  It needs Python 3.11.  A timetable's row times come first, in seconds from the first row.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.clock import seconds

CLASSES = ("table", "timetable")
OBJECTS = ("__function_workspace__", "#subsystem#")  # where the two versions of the format keep them
REMEDY = "in MATLAB, writetable(timetable2table(T), 'run.csv') or writetable(T, 'run.csv') exports it"


def tables_of(path, found: dict) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """({column: array (n,)}, {column: unit}) of all tables of the file, the columns of several with the table's name.

    found: what the plain reader returned, which shows whether the file has objects at all.
    RecordingError if there is a table and no library for it.
    """
    if not any(name in found for name in OBJECTS):
        return {}, {}
    try:
        frames = _frames(path)
    except ImportError:
        raise RecordingError(f"{path}: MATLAB objects need Python 3.11 with mat-io; {REMEDY}") from None
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for table, frame in frames.items():
        before = f"{table}." if len(frames) > 1 else ""
        for name, values, unit in _columns(frame):
            if values is not None:
                columns[before + name] = values
                units |= {before + name: unit} if unit else {}
    return columns, units


def _frames(path) -> dict:
    """{variable: pandas table}."""
    import matio  # pyright: ignore[reportMissingImports]
    import pandas as pd

    infers = pd.options.future.infer_string  # the library sets it for everyone
    try:
        names = [name for name, (_, kind) in matio.whosmat(str(path)).items() if kind in CLASSES]
        loaded = matio.load_from_mat(str(path), variable_names=names, add_table_attrs=True) if names else {}
    finally:
        pd.options.future.infer_string = infers
    return {name: value for name, value in loaded.items() if isinstance(value, pd.DataFrame)}


def _columns(frame):
    """(name, array (n,) or None of what is not numbers, unit) of each column, the row times first."""
    stated = frame.attrs.get("VariableUnits") or frame.attrs.get("varUnits") or []
    if frame.index.dtype.kind in "mM":
        yield str(frame.index.name or "t"), seconds(frame.index.to_numpy()), "s"
    for k, name in enumerate(frame.columns):
        values = frame[name].to_numpy()
        if values.dtype.kind in "mM":
            yield str(name), seconds(values), "s"
        elif values.dtype.kind in "biuf":
            yield str(name), values.astype(float), str(stated[k]).strip() if k < len(stated) else ""
        else:
            yield str(name), None, ""
