"""Parquet files, read with pyarrow."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.clock import seconds
from fluxproof.diagnosis.readers.table import Table, chosen, row_limit, too_long

FORMAT = "Parquet"
SUFFIXES = (".parquet", ".pq")


def matches(head: bytes, path) -> bool:
    return head.startswith(b"PAR1")


def read(path, select=None) -> Table:
    """The numeric columns; units from the field metadata key "unit" if present."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = pq.ParquetFile(path)
    schema = file.schema_arrow
    numeric, text = {}, []
    for column in schema:
        kind = column.type
        if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
            numeric[column.name] = (column.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        elif pa.types.is_decimal(kind) or pa.types.is_timestamp(kind):
            numeric[column.name] = ""
        else:
            text.append(column.name)
    names = chosen(numeric, select, path)
    if len(set(schema.names)) != len(schema.names):
        twice = next(name for name in schema.names if schema.names.count(name) > 1)
        raise RecordingError(f"{path}: duplicate column {twice}")
    limit = row_limit(len(names))
    rows = file.metadata.num_rows
    if rows == 0:
        raise RecordingError(f"{path}: no rows")
    # Row group by row group, so that a size declared by a damaged or hostile footer is never allocated at once.
    parts: dict[str, list[np.ndarray]] = {name: [] for name in names}
    have = 0
    for batch in file.iter_batches(batch_size=1 << 18, columns=names):
        for name in names:
            parts[name].append(_floats(batch.column(name), pa)[: limit - have])
        have += batch.num_rows
        if have >= limit:
            break
    columns = {name: np.concatenate(values) for name, values in parts.items()}
    when = [name for name, values in columns.items() if values.dtype.kind == "M"]
    columns |= {name: seconds(columns[name]) for name in when}
    table = Table(columns, {n: u for n, u in numeric.items() if u}, text=text, meta={"moments": when} if when else {})
    if rows > limit:
        table.problems.append(too_long(limit, rows))
    return table


def _floats(array, pa) -> np.ndarray:
    """One column of a batch as float64, nulls as NaN; a timestamp as datetime64."""
    if pa.types.is_timestamp(array.type):
        return array.cast(pa.timestamp("ns", array.type.tz)).to_numpy(zero_copy_only=False)
    if not pa.types.is_floating(array.type):
        array = array.cast(pa.float64())
    return array.to_numpy(zero_copy_only=False).astype(float, copy=False)
