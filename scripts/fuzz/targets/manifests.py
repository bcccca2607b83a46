# SPDX-License-Identifier: BSD-3-Clause
"""Manifests of `fleet`, as CSV and Parquet."""

from __future__ import annotations

import io

from hypothesis import strategies as st

from fluxproof.fleet.manifest import entries
from scripts.fuzz import corpus
from scripts.fuzz.case import Case
from scripts.fuzz.drawn import damage, tables, text

SECONDS, TURN, NAMES_FILE = 5.0, 60, True
ROWS = (
    "recording,drive,serial,time,temperature,station\n"
    "a.csv,drive.toml,S1,2026-01-01T08:00:00,25.5,line 2\n"
    "b.parquet,,S2,2026-01-02T08:00:00+01:00,,\n"
    "c.csv,drive.toml,,,21,x\n"
)


def cases():
    table = Case(".csv", ROWS.encode())
    return st.one_of(
        text.damaged_table((table,)), damage.damaged((table, _parquet())), rows(), tables.parquet().map(_named)
    )


@st.composite
def rows(draw) -> Case:
    """A manifest with hostile cells in its own columns."""
    import csv

    stream = io.StringIO(newline="")
    writer = csv.writer(stream)
    header = [
        "recording",
        *draw(st.lists(st.one_of(st.sampled_from(("drive", "serial", "time", "temperature")), text.names), max_size=4)),
    ]
    writer.writerow(header)
    special = st.sampled_from(
        (
            "a.csv",
            "drive.toml",
            "/dev/zero",
            "file://a.csv",
            "github://a",
            "simplecache::memory://a",
            "0001-01-01",
            "9999-12-31T23:59:59-23:59",
        )
    )
    for _ in range(draw(st.integers(0, 4))):
        writer.writerow([draw(st.one_of(special, text.words)).replace("\r", "") for _ in header])
    return Case(".csv", draw(text.encoded(stream.getvalue())))


def _parquet() -> Case:
    import pandas as pd

    stream = io.BytesIO()
    pd.read_csv(io.StringIO(ROWS)).to_parquet(stream)
    return Case(".parquet", stream.getvalue())


def _named(case: Case) -> Case:
    """A Parquet table whose first column is `recording`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(io.BytesIO(case.content))
        table = table.rename_columns(["recording", *table.column_names[1:]]).slice(0, 50)
        stream = io.BytesIO()
        pq.write_table(table, stream)
    except (pa.ArrowException, ValueError, IndexError):
        return case
    return Case(".parquet", stream.getvalue())


def run(path) -> None:
    """As the command line's source; the file itself if it is no manifest."""
    drive = path.parent / "drive.toml"
    drive.write_text(corpus.NOMINAL)
    for entry in entries([str(path)], str(drive)):
        assert entry.name and entry.path and entry.drive


def warm(folder) -> None:
    for case in (Case(".csv", ROWS.encode()), _parquet()):
        path = folder / f"valid{case.suffix}"
        path.write_bytes(case.content)
        run(path)
