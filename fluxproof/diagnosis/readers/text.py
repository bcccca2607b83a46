# SPDX-License-Identifier: BSD-3-Clause
"""CSV and other text tables: any separator, decimal point or comma, header with units, comments, no header.

pandas reads the numbers; sniff.py finds the layout.  Without a header the columns are called "1", "2", ...
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem, RecordingError
from fluxproof.diagnosis.readers.clock import moments
from fluxproof.diagnosis.readers.sniff import half_zero, sniff
from fluxproof.diagnosis.readers.table import Table, chosen, repeated, row_limit, shown, too_long

if TYPE_CHECKING:
    import pandas as pd

FORMAT = "text"
SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log")
LIBRARIES = ("pandas",)
MOSTLY_TEXT = 0.5  # a column with a larger share of words is not numeric
FIRST_WORDS = 1000  # of a column, among which thousands separators are looked for
THOUSANDS = {  # by the decimal mark
    ",": re.compile(r"[+-]?[1-9]\d{0,2}([.' ]\d{3})+(,\d*)?"),
    ".": re.compile(r"[+-]?[1-9]\d{0,2}([,' ]\d{3})+(\.\d*)?"),
}


def matches(head: bytes, path) -> bool:
    """Text has no zero bytes, except in UTF-16, and hardly any control characters."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")) or half_zero(head):
        return True
    odd = sum(byte < 32 and byte not in b"\t\n\r\f" for byte in head)
    return b"\0" not in head and odd <= len(head) // 200


def read(path, select=None) -> Table:
    """The numeric columns; a word among numbers becomes NaN and a finding with its line."""
    import pandas as pd

    layout = sniff(path)
    units = {name: unit for name, unit in zip(layout.names, layout.units, strict=True)}
    wanted = chosen(units, select, path, repeated(layout.names), f":{layout.first}")
    index = [layout.names.index(name) for name in wanted]
    limit = row_limit(len(layout.names))
    try:
        frame = pd.read_csv(
            path,
            sep=r"\s+" if layout.separator == " " else layout.separator,
            decimal=layout.decimal,
            encoding=layout.encoding,
            encoding_errors="replace",
            header=None,
            names=range(len(layout.names)),
            index_col=False,
            skiprows=layout.first,
            nrows=limit + 1,
            comment="#",
            skip_blank_lines=False,  # keeps row and line numbers consistent
            skipinitialspace=True,
            low_memory=False,
            compression=None,
            na_values=["-", "-nan", "N/A"],
        )
    except pd.errors.ParserError as error:
        found = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        if found:
            message = f"{path}:{found[2]}: {found[3]} fields; {found[1]} expected as in the lines above"
            raise RecordingError(message) from None
        raise
    table = Table({}, {name: unit for name, unit in units.items() if unit})
    lines = np.arange(len(frame)) + layout.first + 1
    cut = len(frame) > limit
    blank = frame.isna().all(axis=1).to_numpy() if frame.iloc[:, index[0]].isna().any() else None
    if blank is not None and blank.any():
        frame, lines = frame[~blank], lines[~blank]
    if cut:
        frame, lines = frame.iloc[:limit], lines[:limit]
        table.problems.append(too_long(limit))
    elif len(frame) > 1 and not _ends_with_line_end(path):
        frame, lines = frame.iloc[:-1], lines[:-1]
        table.notes.append("the file does not end with a line end; the last row may be truncated and is ignored")
    if not len(frame):
        raise RecordingError(f"{path}: a header but no rows")
    table.lines = lines
    columns = {name: _numbers(frame[k], layout.decimal, pd) for name, k in zip(wanted, index, strict=True)}
    for name, column in columns.items():
        if column.moment:
            table.meta.setdefault("moments", []).append(name)
            table.notes.append(f"{name}: dates or clock times, read as seconds from the first row")
    _reject_thousands(path, columns, lines, layout)
    _leave_out_headers(table, columns, layout)
    for name, column in columns.items():
        _take(table, name, column)
    if not table.columns:
        raise RecordingError(f"{path}:{lines[0]}: no column of numbers")
    return table


@dataclass
class _Column:
    """raw: pandas Series; numbers: (n,), NaN where there is none; words: (n,) bool, where there is a word instead."""

    raw: pd.Series
    numbers: np.ndarray
    words: np.ndarray
    moment: bool = False

    @property
    def text(self) -> bool:
        return bool(np.count_nonzero(self.words) > MOSTLY_TEXT * len(self.words))


def _numbers(values, decimal, pd) -> _Column:
    """A column of the frame; one with any word comes as texts, in which the decimal mark is still the file's."""
    if values.dtype.kind in "biuf":
        return _Column(values, values.to_numpy(float), np.zeros(len(values), bool))
    numbers = moments(values, pd)
    moment = numbers is not None
    if not moment:
        texts = values
        if decimal == ",":  # a point is then no decimal mark, and must not be read as one
            texts = values.astype("string").str.replace(".", "?", regex=False).str.replace(",", ".", regex=False)
        numbers = pd.to_numeric(texts, errors="coerce").to_numpy(float, na_value=np.nan)
    return _Column(values, numbers, np.isnan(numbers) & values.notna().to_numpy(), moment)


def _reject_thousands(path, columns, lines, layout) -> None:
    """RecordingError at a number with thousands separators: whether 1.234 is a thousand nobody can tell for sure."""
    pattern = THOUSANDS[layout.decimal]
    for name, column in columns.items():
        for row in np.flatnonzero(column.words)[:FIRST_WORDS]:
            found = str(column.raw.iloc[row]).strip()
            if pattern.fullmatch(found):
                plain = re.sub(r"[^\d+-]", "", found.partition(layout.decimal)[0])
                plain += found[found.index(layout.decimal) :] if layout.decimal in found else ""
                raise RecordingError(
                    f"{path}:{lines[row]}: column {shown(name)!r}: {shown(found, 30)!r} has thousands separators; "
                    f"the decimal mark is {layout.decimal!r}, {plain!r} was expected: export it without them"
                )


def _leave_out_headers(table: Table, columns, layout) -> None:
    """Leave out lines of words in every column, such as the header of a file that was appended to another."""
    given = [c for c in columns.values() if not c.text]
    if len(given) < 2:
        return
    between = np.all([c.words for c in given], axis=0)
    if not between.any():
        return
    assert table.lines is not None  # a text file has them
    row = int(np.argmax(between))
    names = [str(c.raw.iloc[row]).strip() for c in columns.values()]
    what = "repeats the header: another file was appended" if names == list(columns) else "is a line of words"
    count = np.count_nonzero(between)
    message = f"line {table.lines[row]} {what}{f', as do {count - 1} more' if count > 1 else ''}"
    table.problems.append(Problem("header_inside", message, "", row, int(count), "left out"))
    table.lines = table.lines[~between]
    for c in columns.values():
        c.raw, c.numbers, c.words = c.raw[~between], c.numbers[~between], c.words[~between]


def _take(table: Table, name: str, column: _Column) -> None:
    """Add one column to the table; words among numbers become NaN and a finding."""
    if column.text:
        table.text.append(name)
        return
    table.columns[name] = column.numbers
    words = np.flatnonzero(column.words)
    if len(words):
        assert table.lines is not None  # a text file has them
        row = int(words[0])
        table.problems.append(
            Problem(
                "not_a_number",
                f"line {table.lines[row]}: {shown(column.raw.iloc[row], 30)!r} is not a number",
                name,
                row,
                len(words),
                "treated as missing",
            )
        )


def _ends_with_line_end(path) -> bool:
    with open(path, "rb") as file:
        file.seek(-2, os.SEEK_END)
        return file.read().rstrip(b"\0").endswith((b"\n", b"\r"))
