# SPDX-License-Identifier: BSD-3-Clause
"""NumPy files: .npz with one array per column, .npy with named fields or a plain matrix.

Pickles are never loaded, since loading one runs its code.  A matrix without names has the columns "1", "2", ...
"""

from __future__ import annotations

import math
import zipfile

import numpy as np

from fluxproof.diagnosis.ground.limits import check_cells
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.table import (
    MAX_COLUMNS,
    Table,
    as_columns,
    chosen,
    repeated,
    row_limit,
    shown,
    too_long,
)

FORMAT = "NumPy"
SUFFIXES = (".npy", ".npz")
LIBRARIES = ()
NPY = b"\x93NUMPY"


def matches(head: bytes, path) -> bool:
    if head.startswith(NPY):
        return True
    if not head.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return all(name.endswith(".npy") for name in archive.namelist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return str(path).lower().endswith(".npz")


def read(path, select=None) -> Table:
    """The numeric arrays."""
    with open(path, "rb") as file:
        single = file.read(len(NPY)) == NPY
    return _single(path, select) if single else _archive(path, select)


def _table(arrays, path) -> Table:
    """The chosen arrays as columns."""
    columns, text = as_columns(arrays, path)
    table = Table(columns, text=text)
    longest = max(a.size for a in arrays.values())
    if longest > row_limit(len(arrays)):
        table.problems.append(too_long(row_limit(len(arrays)), longest))
    return table


def _single(path, select) -> Table:
    """The columns of one array, memory-mapped instead of read as a whole."""
    with open(path, "rb") as file:
        _header(path, file, "the array")
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    if array.dtype.names:
        arrays = {name: array[name] for name in array.dtype.names if array.ndim == 1 and array[name].ndim == 1}
    elif array.ndim != 2:
        raise RecordingError(f"{path}: an array of {array.ndim} dimensions without names; a matrix is expected")
    else:
        array = array.T if array.shape[0] < array.shape[1] else array
        arrays = {str(k + 1): array[:, k] for k in range(min(array.shape[1], MAX_COLUMNS))}
    arrays = {name: a for name, a in arrays.items() if a.size > 1}
    names = chosen(dict.fromkeys(arrays, ""), select, path)
    return _table({name: arrays[name] for name in names}, path)


def _archive(path, select) -> Table:
    """The chosen arrays of an .npz; their declared sizes are checked before any is unpacked."""
    with zipfile.ZipFile(path) as archive:
        members = [m for m in archive.infolist() if m.filename.endswith(".npy")]
        sizes, plain = {}, 0
        for member in members:
            name = member.filename.removesuffix(".npy")
            size, is_plain = _declared(path, archive, member)
            plain += is_plain
            # "meta" and other scalars or texts of an archive are not columns.
            if is_plain and size > 1:
                sizes[name] = size
        if not plain:
            raise RecordingError(f"{path}: contains no plain array; pickled objects are not loaded")
        twice = repeated(m.filename.removesuffix(".npy") for m in members)
        names = chosen(dict.fromkeys(sizes, ""), select, path, twice)
        check_cells(path, sum(sizes[name] for name in names))
        arrays = {}
        for name in names:
            with archive.open(f"{name}.npy") as file:
                try:
                    arrays[name] = np.lib.format.read_array(file, allow_pickle=False)
                except ValueError as error:
                    raise RecordingError(f"{path}: array {shown(name)}: {shown(error, 120)}") from None
    return _table(arrays, path)


def _declared(path, archive, member) -> tuple[int, bool]:
    """(numbers that the header of one array declares, whether it is stored without pickled objects)."""
    with archive.open(member) as file:
        shape, dtype = _header(path, file, f"array {shown(member.filename)}")
    return math.prod(shape) * max(1, dtype.itemsize // 8), not dtype.hasobject


def _header(path, file, what: str) -> tuple[tuple[int, ...], np.dtype]:
    """(shape, type) that the header of an array declares; RecordingError for what NumPy cannot survive.

    Of a negative size and elements without bytes NumPy divides by zero, which ends the process.
    """
    form = np.lib.format
    try:
        version = form.read_magic(file)
        header = form.read_array_header_1_0 if version == (1, 0) else form.read_array_header_2_0
        shape, _, dtype = header(file)
    except ValueError as error:
        raise RecordingError(f"{path}: {what}: {shown(error, 120)}") from None
    if any(n < 0 for n in shape):
        raise RecordingError(f"{path}: {what} declares a negative size")
    if not dtype.itemsize:
        raise RecordingError(f"{path}: {what} declares elements of no bytes")
    return shape, dtype
