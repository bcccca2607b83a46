# SPDX-License-Identifier: BSD-3-Clause
"""What needs no diagnosis to be refused: a file that is missing, or of no known format, a table without a column.

A command asks here first, as the libraries of a diagnosis take seconds to import.  Messages are those of a complete
run, which this module leaves to judge everything else; it imports NumPy and nothing that is larger.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

from fluxproof.diagnosis.ground.limits import head_of
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.ingest.columns import plan_columns
from fluxproof.diagnosis.readers import matrices, text
from fluxproof.diagnosis.readers.packed import refuse_packed
from fluxproof.diagnosis.readers.sniff import sniff
from fluxproof.diagnosis.readers.table import chosen, repeated
from fluxproof.quote import escaped
from golden_model.drive_file import read_tables


def refuse_early(recordings, drive, named: dict | None = None) -> None:
    """DriveError or RecordingError for input that no diagnosis can use, if that is seen at once; else nothing.

    recordings, drive: paths; named: entries of [columns] that the command adds.  Of several recordings one without its
    columns is left out and not refused.
    """
    tables = read_tables(drive)
    for path in map(Path, recordings):
        if not path.is_file():
            head_of(path)
    if len(recordings) == 1 and (nominal := _stand_in(tables, drive, named or {})) is not None:
        _refuse_columns(Path(recordings[0]), nominal)


def _stand_in(tables, drive, named):
    """What the plan of the columns needs of a drive; None if the file's error is to be found by those who read it."""
    machine, columns, constants = (tables.get(key, {}) for key in ("machine", "columns", "constants"))
    if not all(isinstance(part, dict) for part in (machine, columns, constants)):
        return None
    pairs = machine.get("pole_pairs")
    if not isinstance(pairs, int) or pairs < 1:
        return None
    return SimpleNamespace(
        machine=SimpleNamespace(pole_pairs=pairs), columns=columns | named, constants=constants, path=str(drive)
    )


def _refuse_columns(path: Path, nominal) -> None:
    """RecordingError if the header of a text table lacks a column."""
    head = head_of(path)
    refuse_packed(path, head)
    if path.suffix.lower() not in text.SUFFIXES or not text.matches(head, path):
        return
    try:
        units, twice, where = _header(head, path)
    except RecordingError:
        raise
    except Exception:  # whatever it is, the reader says it in full
        return
    try:
        chosen(units, lambda names: plan_columns(names, nominal, path).wanted(), path, twice, where)
    except RecordingError as error:
        raise error if escaped(path) in str(error) else RecordingError(f"{path}: {error}") from None
    except Exception:  # a value of [columns] of another type than a name or a table
        return


def _header(head: bytes, path: Path) -> tuple[dict[str, str], list[str], str]:
    """({name: unit} of a text's columns, names that occur twice, ":LINE" of the header)."""
    if matrices.matches(head, path):
        names = matrices.names_of(path)
        return dict.fromkeys(names, ""), repeated(names), ""
    layout = sniff(path)
    units = {name: unit for name, unit in zip(layout.names, layout.units, strict=True)}
    return units, repeated(layout.names), f":{layout.first}"
