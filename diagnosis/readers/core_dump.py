"""The core's own telemetry dump, which diagnosis/telemetry.py decodes."""

from __future__ import annotations

from fluxproof.diagnosis.readers.table import Table, chosen

FORMAT = "telemetry dump"
SUFFIXES = (".dump",)


def matches(head: bytes, path) -> bool:
    try:
        from fluxproof.diagnosis import telemetry
    except ImportError:
        return False
    try:
        return bool(telemetry.is_dump(path))
    except Exception:  # whatever a stranger's file does to it, it is no dump
        return False


def read(path, select=None) -> Table:
    """The canonical columns that the dump's words stand for; registers and raw codes in ``meta``."""
    from fluxproof.diagnosis import telemetry

    columns, meta = telemetry.read_dump(path)
    names = chosen(dict.fromkeys(columns, ""), select, path)
    return Table({name: columns[name] for name in names}, meta=dict(meta))
