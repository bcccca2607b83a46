# SPDX-License-Identifier: BSD-3-Clause
"""The core's own telemetry dump, which diagnosis/replay/telemetry.py decodes."""

from __future__ import annotations

from fluxproof.diagnosis.readers.table import Table, chosen

FORMAT = "telemetry dump"
SUFFIXES = (".dump",)
LIBRARIES = ("fluxproof.diagnosis.replay.telemetry",)


def matches(head: bytes, path) -> bool:
    try:
        from fluxproof.diagnosis.replay import telemetry
    except ImportError:
        return False
    try:
        return bool(telemetry.is_dump(path))
    except Exception:  # any error means that the file is not a dump
        return False


def read(path, select=None) -> Table:
    """The canonical columns of the dump; registers and raw codes in ``meta``."""
    from fluxproof.diagnosis.replay import telemetry

    columns, meta = telemetry.read_dump(path)
    names = chosen(dict.fromkeys(columns, ""), select, path)
    return Table({name: columns[name] for name in names}, meta=dict(meta))
