"""CSV and other text tables: any separator, decimal point or comma, header with units, comments, no header.

pandas reads the numbers; sniff.py finds the layout.  Without a header the columns are called "1", "2", ...
"""

from __future__ import annotations

import os
import re

import numpy as np

from fluxproof.diagnosis.readers.sniff import sniff
from fluxproof.diagnosis.readers.table import Table, chosen, row_limit, shown, too_long
from fluxproof.diagnosis.recording import Problem, RecordingError

FORMAT = "text"
SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log")
MOSTLY_TEXT = 0.5  # a column with a larger share of words is not numeric


def matches(head: bytes, path) -> bool:
    """Text has no zero bytes and hardly any control characters."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return True
    odd = sum(byte < 32 and byte not in b"\t\n\r\f" for byte in head)
    return b"\0" not in head and odd <= len(head) // 200


def read(path, select=None) -> Table:
    """The numeric columns; a word among numbers becomes NaN and a finding with its line."""
    import pandas as pd

    layout = sniff(path)
    units = {name: unit for name, unit in zip(layout.names, layout.units, strict=True)}
    wanted = chosen(units, select, path)
    for name in wanted:
        if layout.names.count(name) > 1:
            raise RecordingError(f"{path}:{layout.first}: duplicate column {shown(name)}")
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
    for name, k in zip(wanted, index, strict=True):
        _take(table, name, frame[k], pd)
    if not table.columns:
        raise RecordingError(f"{path}:{lines[0]}: no column of numbers")
    return table


def _take(table: Table, name: str, values, pd) -> None:
    """Add one column to the table; words among numbers become NaN and a finding."""
    if values.dtype.kind in "biuf":
        table.columns[name] = values.to_numpy(float)
        return
    numbers = pd.to_numeric(values, errors="coerce").to_numpy(float)
    words = np.flatnonzero(np.isnan(numbers) & values.notna().to_numpy())
    if len(words) > MOSTLY_TEXT * len(numbers):
        table.text.append(name)
        return
    table.columns[name] = numbers
    if len(words):
        row = int(words[0])
        table.problems.append(
            Problem(
                "not_a_number",
                f"line {table.lines[row]}: {shown(values.iloc[row], 30)!r} is not a number",
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
