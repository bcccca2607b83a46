"""NumPy files: .npz with one array per column, .npy with named fields or a plain matrix.

Pickles are never loaded, since loading one runs its code.  A matrix without names has the columns "1", "2", ...
"""

from __future__ import annotations

import zipfile

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.table import MAX_CELLS, Table, as_columns, chosen, row_limit, shown, too_long

FORMAT = "NumPy"
SUFFIXES = (".npy", ".npz")
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
    arrays = _single(path) if single else _archive(path)
    # "meta" and other scalars or texts of an archive are not columns.
    arrays = {name: a for name, a in arrays.items() if a.ndim and a.size > 1}
    names = chosen(dict.fromkeys(arrays, ""), select, path)
    columns, text = as_columns({name: arrays[name] for name in names}, path)
    table = Table(columns, text=text)
    longest = max(len(arrays[name]) for name in names)
    if longest > row_limit(len(names)):
        table.problems.append(too_long(row_limit(len(names)), longest))
    return table


def _single(path) -> dict[str, np.ndarray]:
    """The columns of one array, memory-mapped instead of read as a whole."""
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    if array.dtype.names:
        return {name: array[name] for name in array.dtype.names if array.ndim == 1 and array[name].ndim == 1}
    if array.ndim != 2:
        raise RecordingError(
            f"{path}: an array of {array.ndim} dimensions without names; a matrix is expected"
        )
    if array.shape[0] < array.shape[1]:
        array = array.T
    return {str(k + 1): array[:, k] for k in range(min(array.shape[1], 4096))}


def _archive(path) -> dict[str, np.ndarray]:
    """The arrays of an .npz, unpacked only if the declared size is within the limit."""
    with zipfile.ZipFile(path) as archive:
        size = sum(info.file_size for info in archive.infolist())
    if size > 8 * MAX_CELLS:
        raise RecordingError(
            f"{path}: unpacks to {size / 1e9:.1f} GB; at most {8 * MAX_CELLS / 1e9:.1f} GB are read"
        )
    arrays = {}
    with np.load(path, allow_pickle=False) as archive:
        for name in archive.files:
            try:
                arrays[name] = archive[name]
            except ValueError as error:
                if "pickle" not in str(error).lower():
                    raise RecordingError(f"{path}: array {shown(name)}: {shown(error, 120)}") from None
    if not arrays:
        raise RecordingError(f"{path}: contains no plain array; pickled objects are not loaded")
    return arrays
