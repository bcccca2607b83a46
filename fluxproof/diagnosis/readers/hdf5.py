"""HDF5 files: every numeric data set of the common length is a column, in any group.

The last part of a data set's path is its name if that is unique.  Units come from an attribute "unit" or "units";
tables of named fields (PyTables, pandas) give one column per field.  Links to other files and external data are
rejected for security.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.table import MAX_CELLS, Table, as_columns, chosen, row_limit, shown, too_long

FORMAT = "HDF5"
SUFFIXES = (".h5", ".hdf5", ".hdf", ".he5")
SIGNATURE = b"\x89HDF\r\n\x1a\n"
MOST_OBJECTS = 20_000
MOST_CHUNK = 1 << 30  # bytes that one compressed chunk may unpack to


def matches(head: bytes, path) -> bool:
    return head.startswith(SIGNATURE)


def read(path, select=None) -> Table:
    """The numeric data sets."""
    import h5py

    with h5py.File(path, "r") as file:
        places, units = _columns(safe_datasets(file, path))
        names = chosen(units, select, path)
        limit = row_limit(len(names))
        arrays, longest = {}, 0
        for name in names:
            dataset, pick = places[name]
            longest = max(longest, max(dataset.shape))
            arrays[name] = _slice(dataset, pick, limit)
        columns, text = as_columns(arrays, path)
        table = Table(columns, {n: units[n] for n in names if units[n]}, text=text)
    if longest > limit:
        table.problems.append(too_long(limit, longest))
    return table


def safe_datasets(file, path) -> dict:
    """{path in the file: data set} of all data sets stored in this file; RecordingError for unreasonable sizes."""
    import h5py

    found = {}

    def visit(name, item):
        if len(found) >= MOST_OBJECTS:
            raise RecordingError(f"{path}: more than {MOST_OBJECTS} data sets")
        if not isinstance(item, h5py.Dataset):
            _refuse_links(item, path)
            return
        where = f"{path}: data set {shown(name)}"
        if item.external or item.is_virtual:
            raise RecordingError(f"{where} stores its data in another file; such links are not followed")
        chunk = item.chunks or (1,)
        if np.prod(chunk, dtype=float) * item.dtype.itemsize > MOST_CHUNK:
            raise RecordingError(f"{where} has chunks above 1 GB")
        found[name] = item

    _refuse_links(file, path)
    file.visititems(visit)
    return found


def _refuse_links(group, path) -> None:
    import h5py

    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            target = shown(link.filename)
            raise RecordingError(
                f"{path}: {shown(name)} is a link to another file ({target}); such links are not followed"
            )


def _columns(datasets):
    """({column: (data set, field, index or None)}, {column: unit})."""
    places, units = {}, {}
    last = [name.rsplit("/", 1)[-1] for name in datasets]
    for path, short in zip(datasets, last, strict=True):
        dataset = datasets[path]
        name = short if last.count(short) == 1 else path
        unit = _unit(dataset)
        if dataset.dtype.names and dataset.ndim == 1:
            for field in dataset.dtype.names:
                if dataset.dtype[field].kind in "biuf":
                    places[field] = dataset, field
                    units[field] = ""
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
        return dataset[:limit][pick]
    if pick is not None:
        return dataset[pick, :limit] if dataset.shape[0] < dataset.shape[1] else dataset[:limit, pick]
    axis = int(np.argmax(dataset.shape))
    return dataset[tuple(slice(limit) if k == axis else 0 for k in range(dataset.ndim))]


def declared_cells(datasets) -> int:
    """How many numbers the data sets declare; above MAX_CELLS they must not be read at once."""
    return int(
        min(sum(float(np.prod(d.shape or (1,), dtype=float)) for d in datasets.values()), 2.0 * MAX_CELLS)
    )
