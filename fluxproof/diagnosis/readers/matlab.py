# SPDX-License-Identifier: BSD-3-Clause
"""MATLAB .mat files of versions 5 to 7.3, read with pymatreader (scipy below 7.3, h5py for 7.3).

Structures are flattened: "run.i_a".  Lists of named signals as in dSPACE ControlDesk (X, Y(k).Name, Y(k).Data) and
Simulink ("structure with time": signals(k).label, .values) are read under the names of the signals.
Tables and timetables: readers/matlab_tables.py.  Objects of other classes (timeseries) contain no plain numbers; save
arrays or a structure instead.
"""

from __future__ import annotations

import os
import struct
import zlib

import numpy as np

from fluxproof.diagnosis.ground.limits import check_cells, most_cells
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.grids import flat
from fluxproof.diagnosis.readers.hdf5 import SIGNATURE
from fluxproof.diagnosis.readers.hdf5_walk import check_readable, check_references, tree
from fluxproof.diagnosis.readers.matlab_tables import tables_of
from fluxproof.diagnosis.readers.table import Table, as_columns, chosen, row_limit, too_long

FORMAT = "MATLAB"
SUFFIXES = (".mat",)
LIBRARIES = ("h5py", "pymatreader")
COMPRESSED = 15  # tag of a compressed element of a version 5 file
NAMES, VALUES, UNITS = (
    ("Name", "name", "label", "Label"),
    ("Data", "data", "values", "Values"),
    ("Unit", "unit", "Units"),
)
DEEP = 12
OBJECT = "None"  # the name that SciPy gives an object of a class


def matches(head: bytes, path) -> bool:
    return head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"))


def read(path, select=None) -> Table:
    """The numeric arrays of one length, with structures flattened."""
    from pymatreader import read_mat

    with open(path, "rb") as file:
        head = file.read(520)
    if head[512:].startswith(SIGNATURE) or b"MATLAB 7.3" in head[:20]:
        import h5py

        with h5py.File(path, "r") as file:
            datasets, known = tree(file, path)
            check_references(datasets, known, path)
            check_cells(path, sum(dataset.size or 0 for dataset in datasets.values()))
            for dataset in datasets.values():
                if dataset.size:
                    check_readable(dataset, path)
    else:
        _limit_inflated(path)
    arrays: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    found = read_mat(str(path))
    for name, value in found.items():
        if not name.startswith(("__", "#")) and name != OBJECT:
            _collect(name, value, arrays, units, 0)
    for name, values in (tabled := tables_of(path, found))[0].items():
        _put(name, values, arrays)
    units |= tabled[1]
    arrays = flat({name: a for name, a in arrays.items() if a.size > 1})
    names = chosen({name: units.get(name, "") for name in arrays}, select, path)
    columns, text = as_columns({name: arrays[name] for name in names}, path)
    table = Table(columns, {n: u for n, u in units.items() if n in columns}, text=text)
    longest = max(arrays[name].size for name in names)
    if longest > row_limit(len(names)) * 64:
        table.problems.append(too_long(row_limit(len(names)), longest))
    return table


def _collect(name, value, arrays, units, depth) -> None:
    """Put every numeric array below ``value`` into ``arrays`` under a unique name."""
    if depth > DEEP:
        return
    if isinstance(value, dict):
        signal = _first(value, NAMES)
        data = _first(value, VALUES)
        if isinstance(data, np.ndarray) and data.dtype.kind in "biuf":
            own = signal.strip() if isinstance(signal, str) else ""
            own = own or ("time" if name.rsplit(".", 1)[-1].startswith("X") else name)
            _put(own, data, arrays)
            unit = _first(value, UNITS)
            if isinstance(unit, str) and unit.strip():
                units[own] = unit.strip()
            return
        if isinstance(data, list) and isinstance(signal, list) and len(data) == len(signal):
            unit = _first(value, UNITS)
            unit = unit if isinstance(unit, list) and len(unit) == len(data) else [None] * len(data)
            for own, item, u in zip(signal, data, unit, strict=True):
                _collect(name, {"Name": own, "Data": item, "Unit": u}, arrays, units, depth + 1)
            return
        for key, item in value.items():
            # The outer structure only wraps the file; the inner names are unique.
            _collect(key if depth == 0 else f"{name}.{key}", item, arrays, units, depth + 1)
    elif isinstance(value, list):
        for k, item in enumerate(value):
            _collect(f"{name}[{k}]", item, arrays, units, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        _put(name, value, arrays)


def _first(value, keys):
    return next((value[key] for key in keys if key in value), None)


def _put(name, array, arrays) -> None:
    k = 2
    own = name
    while own in arrays:
        own, k = f"{name} ({k})", k + 1
    arrays[own] = np.squeeze(array)


def _limit_inflated(path) -> None:
    """Reject a version 5 file whose compressed elements unpack to more than the limit of its size."""
    most = left = 8 * most_cells(os.stat(path).st_size)
    with open(path, "rb") as file:
        head = file.read(128)
        order = "<" if head[126:128] == b"IM" else ">"
        while len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(order + "II", tag)
            if kind != COMPRESSED:
                file.seek(size, 1)
                continue
            unpacker = zlib.decompressobj()
            while size > 0 and (packed := file.read(min(size, 1 << 20))):
                size -= len(packed)
                while packed:
                    left -= len(unpacker.decompress(packed, 1 << 24))
                    packed = unpacker.unconsumed_tail
                    if left < 0:
                        size = os.stat(path).st_size
                        raise RecordingError(f"{path}: unpacks from {size} bytes to more than {most / 1e6:.0f} MB")
