# SPDX-License-Identifier: BSD-3-Clause
"""Parquet files, read with pyarrow."""

from __future__ import annotations

import os

import numpy as np

from fluxproof.diagnosis.ground.limits import check_cells, most_cells
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.clock import seconds
from fluxproof.diagnosis.readers.table import Table, chosen, repeated, row_limit, shown, too_long

FORMAT = "Parquet"
SUFFIXES = (".parquet", ".pq")
LIBRARIES = ("pyarrow.parquet",)
UNNAMED_INDEX, TIME = "__index_level_0__", "t"  # the name that pandas gives it


def matches(head: bytes, path) -> bool:
    return head.startswith(b"PAR1")


def read(path, select=None) -> Table:
    """The numeric columns; units from the field metadata key "unit" if present."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = pq.ParquetFile(pa.OSFile(str(path)))  # never an address of a remote store
    schema = file.schema_arrow
    numeric, text, called = {}, [], _called(schema, pa)
    for column in schema:
        kind = column.type
        if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
            numeric[column.name] = (column.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        elif pa.types.is_decimal(kind) or _is_time(kind, pa):
            numeric[called.get(column.name, column.name)] = ""
        else:
            text.append(column.name)
    names = chosen(numeric, select, path, repeated(schema.names))
    limit = row_limit(len(names))
    rows = file.metadata.num_rows
    if rows == 0:
        raise RecordingError(f"{path}: no rows")
    check_cells(path, min(rows, limit) * len(names))
    stored = {shown_name: name for name, shown_name in called.items()}
    in_file = [stored.get(name, name) for name in names]
    _check_pages(path, file.metadata, in_file)
    # Batch by batch, so that a size declared by a damaged or hostile footer is never allocated at once.
    parts: dict[str, list[np.ndarray]] = {name: [] for name in names}
    have = 0
    for batch in file.iter_batches(batch_size=1 << 18, columns=in_file):
        for name, column in zip(names, in_file, strict=True):
            parts[name].append(_floats(batch.column(column), pa)[: limit - have])
        have += batch.num_rows
        if have >= limit:
            break
    columns = {name: np.concatenate(values) for name, values in parts.items()}
    when = [name for name, values in columns.items() if values.dtype.kind in "mM"]
    columns |= {name: seconds(columns[name]) for name in when}
    table = Table(columns, {n: u for n, u in numeric.items() if u}, text=text, meta={"moments": when} if when else {})
    if called and when and stored.keys() & set(when):
        table.notes.append("the index of the table, which has no name, is read as the time")
    if rows > limit:
        table.problems.append(too_long(limit, rows))
    return table


def _called(schema, pa) -> dict[str, str]:
    """{column: "t"} of a table's index without a name, if it is a time and no column is called so."""
    index = [c.name for c in schema if c.name == UNNAMED_INDEX and _is_time(c.type, pa)]
    return {} if TIME in schema.names else dict.fromkeys(index, TIME)


def _is_time(kind, pa) -> bool:
    return pa.types.is_timestamp(kind) or pa.types.is_duration(kind)


def _check_pages(path, metadata, names) -> None:
    """RecordingError if a column of a row group, which is read as a whole, unpacks to more than the file's limit."""
    most = 8 * most_cells(os.stat(path).st_size)
    for k in range(metadata.num_row_groups):
        group = metadata.row_group(k)
        for c in range(group.num_columns):
            column = group.column(c)
            if column.path_in_schema in names and column.total_uncompressed_size > most:
                raise RecordingError(
                    f"{path}: column {shown(column.path_in_schema)} of row group {k} unpacks to "
                    f"{column.total_uncompressed_size} bytes; at most {most} are read of a file of this size"
                )


def _floats(array, pa) -> np.ndarray:
    """One column of a batch as float64, nulls as NaN; a timestamp as datetime64, a duration as timedelta64."""
    if pa.types.is_timestamp(array.type):
        return array.cast(pa.timestamp("ns", array.type.tz)).to_numpy(zero_copy_only=False)
    if pa.types.is_duration(array.type):
        return array.cast(pa.duration("ns")).to_numpy(zero_copy_only=False)
    if not pa.types.is_floating(array.type):
        array = array.cast(pa.float64())
    return array.to_numpy(zero_copy_only=False).astype(float, copy=False)
