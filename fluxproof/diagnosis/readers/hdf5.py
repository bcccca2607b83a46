# SPDX-License-Identifier: BSD-3-Clause
"""HDF5 files: every numeric data set of the common length is a column, in any group.

The last part of a data set's path is its name if that is unique.  Units come from an attribute "unit" or "units";
tables of named fields (PyTables, pandas) give one column per field.  Links to other files, external data and filters
that need a plugin are refused (hdf5_walk.py).
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.limits import check_cells
from fluxproof.diagnosis.readers.hdf5_walk import check_readable, safe_datasets
from fluxproof.diagnosis.readers.table import Table, as_columns, chosen, repeated, row_limit, shown, too_long

FORMAT = "HDF5"
SUFFIXES = (".h5", ".hdf5", ".hdf", ".he5")
LIBRARIES = ("h5py",)
SIGNATURE = b"\x89HDF\r\n\x1a\n"


def matches(head: bytes, path) -> bool:
    return head.startswith(SIGNATURE)


def read(path, select=None) -> Table:
    """The numeric data sets."""
    import h5py

    with h5py.File(path, "r") as file:
        places, units = _columns(safe_datasets(file, path))
        names = chosen(units, select, path)
        limit = row_limit(len(names))
        arrays, longest, cells = {}, 0, 0
        for name in names:
            dataset, pick = places[name]
            longest = max(longest, *dataset.shape)
            cells += min(limit, max(dataset.shape))
            check_cells(path, cells, f"data set {shown(dataset.name)}")
            check_readable(dataset, path)
            arrays[name] = _slice(dataset, pick, limit)
        columns, text = as_columns(arrays, path)
        table = Table(columns, {n: units[n] for n in names if units[n]}, text=text)
    if longest > limit:
        table.problems.append(too_long(limit, longest))
    return table


def _columns(datasets):
    """({column: (data set, field, index or None)}, {column: unit})."""
    places, units = {}, {}
    fields = repeated(f for d in datasets.values() for f in d.dtype.names or ())
    last = [name.rsplit("/", 1)[-1] for name in datasets]
    for path, short in zip(datasets, last, strict=True):
        dataset = datasets[path]
        name = short if last.count(short) == 1 else path
        unit = _unit(dataset)
        if dataset.dtype.names and dataset.ndim == 1:
            for field in dataset.dtype.names:
                if dataset.dtype[field].kind in "biuf":
                    own = f"{path}/{field}" if field in fields or field in last else field
                    places[own] = dataset, field
                    units[own] = ""
        elif dataset.dtype.kind in "biuf" and dataset.size and dataset.size > 1:
            shape = [s for s in dataset.shape if s > 1]
            if len(shape) == 1:
                places[name], units[name] = (dataset, None), unit
            elif len(shape) == 2 and dataset.ndim == 2 and min(shape) <= 64:
                for k in range(min(shape)):
                    places[f"{name}[{k}]"], units[f"{name}[{k}]"] = (dataset, k), unit
    return places, units


def _unit(dataset) -> str:
    for key in ("unit", "units", "Unit", "Units"):
        value = dataset.attrs.get(key)
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        if isinstance(value, str):
            return value.strip()
    return ""


def _slice(dataset, pick, limit) -> np.ndarray:
    """At most ``limit`` values of a column, read without the rest."""
    if isinstance(pick, str):
        return dataset.fields(pick)[:limit]
    if pick is not None:
        return dataset[pick, :limit] if dataset.shape[0] < dataset.shape[1] else dataset[:limit, pick]
    axis = int(np.argmax(dataset.shape))
    return dataset[tuple(slice(limit) if k == axis else 0 for k in range(dataset.ndim))]
