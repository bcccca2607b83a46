# SPDX-License-Identifier: BSD-3-Clause
"""Rows on disk: OUT/rows/KEY.parquet, each written whole or not at all, and OUT/fleet.parquet made of them.

The key is a hash of what a row follows from, so that a later run finds what is done and does again what changed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from fluxproof.diagnosis.fleet.row import failed_row
from fluxproof.diagnosis.fleet.schema import schema
from fluxproof.files import replacing
from fluxproof.fleet.addresses import spelled

ROWS, FLEET = "rows", "fleet.parquet"


class Rows:
    """The rows of a folder by key."""

    def __init__(self, out: Path):
        self.folder = Path(out) / ROWS
        for left in self.folder.glob(".*.tmp"):  # of a run that was stopped while writing
            left.unlink(missing_ok=True)

    def path(self, key: str) -> Path:
        return self.folder / f"{key}.parquet"

    def has(self, key: str) -> bool:
        """Whether the row is there and whole; one that the disk has damaged is removed."""
        try:
            return pq.read_metadata(self.path(key)).num_rows == 1
        except FileNotFoundError:
            return False
        except (OSError, ValueError):
            self.path(key).unlink(missing_ok=True)
            return False

    def write(self, key: str, row: dict) -> None:
        """Write one row in one step; OSError where it cannot be written, and then nothing of it stays."""
        write_table(self.path(key), pa.Table.from_pylist([row], schema(of_file_only=True)))

    def read(self, key: str) -> dict | None:
        """The row, or None if its file is missing or damaged, which is then removed."""
        try:
            options: dict[str, Any] = {"memory_map": False, "partitioning": None}
            return pq.read_table(self.path(key), **options).to_pylist()[0]
        except FileNotFoundError:
            return None
        except (OSError, ValueError, IndexError):
            self.path(key).unlink(missing_ok=True)
            return None


def write_table(path: Path, table: pa.Table) -> None:
    """A Parquet file, written under a temporary name and renamed."""
    with replacing(path) as temporary:
        pq.write_table(table, temporary, compression="zstd")


def joined(entries, keys: dict[str, str], rows: Rows, failures: dict[str, str]) -> list[dict]:
    """One row for each entry, sorted by name; failures: {name: reason} of what has no lasting row."""
    out, read = [], {}
    for entry in sorted(entries, key=lambda e: e.name):
        key = keys.get(entry.name, "")
        row = None
        if entry.name not in failures:
            row = read.setdefault(key, rows.read(key)) if key else None
        if row is None:
            row = failed_row(failures.get(entry.name, "not diagnosed: the run was stopped"))
        head = dict(recording=entry.name, drive=spelled(entry.drive), serial=entry.serial, time=entry.time,
                    temperature=entry.temperature, more=sorted(entry.more.items()), key=key)  # fmt: skip
        status = "failed" if row.get("reason") else "done"
        out.append({**row, **head, "status": status})
    return out


def write_fleet(out: Path, rows: list[dict]) -> Path:
    """OUT/fleet.parquet, sorted by recording."""
    path = Path(out) / FLEET
    write_table(path, pa.Table.from_pylist(rows, schema()))
    return path
