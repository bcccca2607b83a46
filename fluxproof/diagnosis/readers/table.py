# SPDX-License-Identifier: BSD-3-Clause
"""The result of every reader: named numeric columns of one length, with units and line numbers.

A reader is one file in this folder with

    FORMAT    its name in messages
    SUFFIXES  file names that claim this format, lower case, with the dot
    LIBRARIES what ``read`` imports, which neither counts as its time nor as its memory
    matches(head, path)  whether the content (first bytes) is this format
    read(path, select)   -> Table

``select`` receives {column name: unit or ""} and returns the names to read, so that only the required channels of a
large file use memory; None reads all.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fluxproof.diagnosis.ground.limits import MAX_CELLS
from fluxproof.diagnosis.ground.recording import Problem, RecordingError
from fluxproof.quote import shown

MAX_ROWS = 20_000_000
MAX_COLUMNS = 4096

Select = Callable[[dict[str, str]], list[str]]


@dataclass
class Table:
    """Columns of a file: float64, shape (n,), without unit conversion.

    lines: (n,) line number of each row in a text file, or None.
    text: names of columns without numbers.
    meta: further contents of the file; "sample_time_s" if it states one.
    """

    columns: dict[str, np.ndarray]
    units: dict[str, str] = field(default_factory=dict)
    lines: np.ndarray | None = None
    text: list[str] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    meta: dict = field(default_factory=dict)


def chosen(names: dict[str, str], select: Select | None, path, twice=(), where: str = "") -> list[str]:
    """The names to read, at most MAX_COLUMNS.

    twice: names that the file gives to several columns; RecordingError if one of them is needed, since nobody can tell
    which is meant.  where: ":LINE" of the names.
    """
    try:
        wanted = list(names) if select is None else select(names)
    except RecordingError as error:
        if not twice:
            raise
        raise RecordingError(f"{error}; the file has column {shown(twice[0])} twice, is one of them this?") from None
    doubtful = [name for name in wanted if name in twice]
    if doubtful:
        raise RecordingError(f"{path}{where}: duplicate column {shown(doubtful[0])}; each name is needed once")
    if len(wanted) > MAX_COLUMNS:
        raise RecordingError(f"{path}: {len(wanted)} columns; at most {MAX_COLUMNS} are read")
    if not wanted:
        raise RecordingError(f"{path}: contains no numeric column")
    return wanted


def repeated(names) -> list[str]:
    """The names that occur more than once, in order."""
    return [name for name, count in Counter(names).items() if count > 1]


def row_limit(n_columns: int) -> int:
    """Largest number of rows that are read of ``n_columns`` columns."""
    return min(MAX_ROWS, MAX_CELLS // max(1, n_columns))


def too_long(limit: int, rows: int | None = None) -> Problem:
    """The finding that a file was truncated at ``limit`` rows."""
    of = f" of {rows}" if rows else ""
    return Problem(
        "too_long", f"only the first {limit} rows{of} are read", row=limit, action="the other rows are ignored"
    )


def as_columns(arrays: dict[str, object], path) -> tuple[dict[str, np.ndarray], list[str]]:
    """(numeric columns as float64, names of the others) from arrays of one length; RecordingError if ragged.

    Arrays of shape (n, 1) and (1, n) count as (n,); (n, m) and (m, n) with small m become columns name[0] ...
    Scalars are repeated over the whole length.
    """
    flat: dict[str, np.ndarray] = {}
    text = []
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.dtype.kind not in "biuf" or array.size == 0:
            text.append(name)
            continue
        array = np.squeeze(array)
        if array.ndim == 2 and min(array.shape) <= 64:
            rows = array.T if array.shape[0] > array.shape[1] else array
            flat |= {f"{name}[{k}]": row for k, row in enumerate(rows)}
        elif array.ndim <= 1:
            flat[name] = np.atleast_1d(array)
        else:
            text.append(name)
    flat = dict(list(flat.items())[:MAX_COLUMNS])
    n = max((len(a) for a in flat.values()), default=0)
    if n == 0:
        raise RecordingError(f"{path}: contains no numeric array")
    wrong = {name: len(a) for name, a in flat.items() if len(a) not in (1, n)}
    if wrong:
        name, length = next(iter(wrong.items()))
        raise RecordingError(f"{path}: array {shown(name)} has {length} values, others {n}; one length is needed")
    limit = row_limit(len(flat))
    columns = {}
    for name, array in flat.items():
        array = array[:limit].astype(float)
        columns[name] = array if len(array) == min(n, limit) else np.full(min(n, limit), array[0])
    return columns, text
