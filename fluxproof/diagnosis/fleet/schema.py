# SPDX-License-Identifier: BSD-3-Clause
"""The columns of fleet.parquet: name, type and meaning, declared once; docs/fleet.md shows the same table."""

from __future__ import annotations

from dataclasses import dataclass

import pyarrow as pa

SCHEMA = 1  # changes if a column is removed or changes its meaning, not if one is added


@dataclass(frozen=True)
class Column:
    """A column; of_file: it follows from recording and drive file alone, and not from the manifest."""

    name: str
    type: pa.DataType
    meaning: str
    of_file: bool = True


ESTIMATE = pa.struct(
    [("effect", pa.string()), ("parameter", pa.string()), ("value", pa.float64()), ("sigma", pa.float64()),
     ("unit", pa.string())]
)  # fmt: skip
PART = pa.struct(
    [("signal", pa.string()), ("order", pa.float64()), ("size", pa.float64()), ("unit", pa.string()),
     ("share", pa.float64())]
)  # fmt: skip
NAME = pa.struct([("effect", pa.string()), ("confidence", pa.float64()), ("explains", pa.float64())])
UNKNOWN = pa.struct(
    [("signal", pa.string()), ("formula", pa.string()), ("value", pa.float64()), ("sigma", pa.float64()),
     ("unit", pa.string()), ("explains", pa.float64()), ("meaning", pa.string())]
)  # fmt: skip
HYPOTHESIS = pa.struct(
    [("extras", pa.list_(pa.string())), ("evidence", pa.float64()), ("credible", pa.list_(pa.float64())),
     ("estimates", pa.list_(ESTIMATE)), ("left", pa.list_(PART)), ("left_share", pa.float64())]
)  # fmt: skip
WORDS = pa.list_(pa.string())

COLUMNS = (
    Column("recording", pa.string(), "name of the recording as given, relative to the manifest's folder", False),
    Column("drive", pa.string(), "drive file", False),
    Column("serial", pa.string(), "serial number; without one, the recording is a drive of its own", False),
    Column("time", pa.timestamp("us", "UTC"), "when it was recorded, by the manifest", False),
    Column("temperature", pa.float64(), "°C, by the manifest", False),
    Column("more", pa.map_(pa.string(), pa.string()), "the manifest's other columns as text", False),
    Column("status", pa.string(), "`done`, or `failed` with a reason", False),
    Column("reason", pa.string(), "why it failed: one line"),
    Column("design", pa.string(), "hash of the drive file: recordings of one design are one population"),
    Column("key", pa.string(), "hash of recording, drive file and version: what resuming compares", False),
    Column("version", pa.string(), "version of Fluxproof and hash of its source"),
    Column("verdict", pa.string(), "as in diagnosis.json"),
    Column("sentence", pa.string(), "as in diagnosis.json"),
    Column("rows", pa.int64(), "rows of the recording"),
    Column("names", pa.list_(NAME), "named effects with posterior (`confidence`) and share (`explains`)"),
    Column("parameters", pa.list_(ESTIMATE), "parameters of the named effects with sigma"),
    Column("ambiguity", pa.list_(WORDS), "groups of which one effect is present"),
    Column("explained_share", pa.float64(), "of the misfit's power above the noise floor, at held-out points"),
    Column("misfit_before", pa.float64(), "rms at held-out points"),
    Column("misfit_after", pa.float64(), "rms at held-out points"),
    Column("noise_floor", pa.float64(), "rms"),
    Column("misfit_unit", pa.string(), "of the three above: V"),
    Column("remainder", pa.list_(PART), "residual of the named effects: signal, electrical order, rms size, share"),
    Column("unknown", UNKNOWN, "the single term that fits the residual best"),
    Column("conventions", WORDS, "codes of mistaken conventions"),
    Column("problems", WORDS, "codes of what the checks found"),
    Column("digital", pa.string(), "`not recorded`, `equal`, or block, sample, signal and bit of a difference"),
    Column("hypotheses", pa.list_(HYPOTHESIS), "sets of effects beyond production tolerance (hypotheses.py)"),
)


def schema(of_file_only: bool = False) -> pa.Schema:
    """The schema of fleet.parquet, or of the part that a row file holds."""
    fields = [pa.field(c.name, c.type) for c in COLUMNS if c.of_file or not of_file_only]
    return pa.schema(fields, metadata={"fluxproof_fleet": str(SCHEMA)})


def described() -> str:
    """The columns as a table in Markdown."""
    lines = ["| column | type | meaning |", "|---|---|---|"]
    return "\n".join([*lines, *(f"| `{c.name}` | {_type(c.type)} | {c.meaning} |" for c in COLUMNS)])


def _type(kind) -> str:
    if pa.types.is_list(kind):
        return f"list of {_type(kind.value_type)}"
    if pa.types.is_struct(kind):
        return "(" + ", ".join(kind.field(n).name for n in range(kind.num_fields)) + ")"
    if pa.types.is_map(kind):
        return "map"
    return {"double": "float", "timestamp[us, tz=UTC]": "time, UTC"}.get(str(kind), str(kind))
