"""Which recordings there are: folders, globs, files, addresses of object stores, and manifests (CSV or Parquet).

A manifest has a column ``recording`` and may have ``drive`` (drive file), ``serial``, ``time`` (ISO 8601),
``temperature`` (degC) and any others, which are kept as text.  Relative paths are relative to the manifest's folder.
"""

from __future__ import annotations

import csv
import datetime
import glob
from dataclasses import dataclass, field
from pathlib import Path

import fsspec
import pandas as pd

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers import readers
from fluxproof.fleet.work import remote

KNOWN = ("recording", "drive", "serial", "time", "temperature")
EXAMPLE = "2026-11-25T08:00:00"
HEAD_BYTES = 4096


@dataclass(frozen=True)
class Entry:
    """One recording of a fleet; path: where it is; name: as it was given, which is unique in a fleet."""

    name: str
    path: str
    drive: str
    serial: str
    time: datetime.datetime | None = None
    temperature: float | None = None
    more: dict = field(default_factory=dict, hash=False)


def entries(sources: list[str], drive: str | None) -> list[Entry]:
    """All recordings of the command line, sorted by name; drive: the drive file where a manifest names none.

    Raises RecordingError: nothing found, a manifest's line and column with what was expected, a recording named twice.
    """
    out = []
    for source in sources:
        out += _of(source, drive)
    if not out:
        raise RecordingError(f"{', '.join(sources)}: no recording found")
    seen: dict[str, Entry] = {}
    for entry in out:
        other = seen.setdefault(entry.name, entry)
        if other is not entry and other != entry:
            raise RecordingError(f"{entry.name}: named twice, with different drive file, serial number or time")
    for entry in seen.values():
        if not Path(entry.drive).is_file():
            raise RecordingError(f"{entry.drive}: drive file of {entry.name}: no such file")
    return sorted(seen.values(), key=lambda e: e.name)


def _of(source: str, drive) -> list[Entry]:
    if remote(source):
        return [_plain(path, drive) for path in _remote(source)]
    path = Path(source)
    if path.is_dir():
        return [_plain(str(p), drive) for p in sorted(path.rglob("*")) if _is_recording(p)]
    if not path.exists():
        found = sorted(glob.glob(source, recursive=True))
        if not found:
            raise RecordingError(f"{source}: no such file or folder, and no file matches it")
        return [entry for name in found for entry in _of(name, drive)]
    header = _header(path)
    if "recording" in header:
        return _manifest(path, drive)
    return [_plain(source, drive)]


def _plain(path: str, drive) -> Entry:
    if drive is None:
        raise RecordingError(f"{path}: --drive drive.toml is missing, and no manifest names a drive file")
    return Entry(path, path, str(drive), path)


def _remote(source: str) -> list[str]:
    """The addresses that a pattern of an object store matches; a folder's files if it ends in /."""
    if source.endswith("/"):
        source += "*"
    if "*" not in source:
        return [source]
    system, path = fsspec.core.url_to_fs(source)
    tail = "::" + source.split("::", 1)[1] if "::" in source else ""
    names = sorted(system.glob(path))
    if not names:
        raise RecordingError(f"{source}: no file matches it")
    return [f"{source.split('://')[0]}://{name}{tail}" if tail else system.unstrip_protocol(name) for name in names]


def _is_recording(path: Path) -> bool:
    """Whether a file of a folder has the suffix of a readable format and is no manifest or hidden file."""
    suffixes = {s for reader in readers() for s in reader.SUFFIXES}
    if path.name.startswith(".") or not path.is_file() or path.suffix.lower() not in suffixes:
        return False
    return "recording" not in _header(path)


def _header(path: Path) -> list[str]:
    """Names of the columns if the file can be a manifest, else none."""
    if path.suffix.lower() == ".parquet":
        import pyarrow.parquet as pq

        try:
            return pq.read_schema(path).names
        except (OSError, ValueError):  # damaged: it is a recording that fails, with a reason
            return []
    if path.suffix.lower() not in (".csv", ".txt"):
        return []
    try:
        with open(path, encoding="utf-8-sig", errors="replace", newline="") as file:
            return [name.strip() for name in next(csv.reader([file.readline(HEAD_BYTES)]), [])]
    except (OSError, csv.Error):
        return []


def _manifest(path: Path, drive) -> list[Entry]:
    table = _table(path)
    return [_entry(path, line, cells, drive) for line, cells in table]


def _table(path: Path) -> list[tuple[int, dict]]:
    """[(line, {column: text})]; of a Parquet file the line is the row, counted from 1."""
    if path.suffix.lower() == ".parquet":
        frame = pd.read_parquet(path)
        records = frame.astype(object).where(frame.notna(), "").to_dict("records")
        return [(n, {k: str(v) for k, v in record.items()}) for n, record in enumerate(records, 1)]
    with open(path, encoding="utf-8-sig", newline="") as file:
        reader = csv.reader(file)
        try:
            header = [name.strip() for name in next(reader)]
            twice = next((name for n, name in enumerate(header) if name in header[:n]), None)
            if twice is not None:
                raise RecordingError(f"{path}:1: column {twice!r} twice")
            rows = []
            for cells in reader:
                if not any(cell.strip() for cell in cells):
                    continue
                if len(cells) != len(header):
                    expected = f"{len(header)} columns expected, as in line 1"
                    raise RecordingError(f"{path}:{reader.line_num}: {len(cells)} columns; {expected}")
                pairs = zip(header, (cell.strip() for cell in cells), strict=True)
                rows.append((reader.line_num, dict(pairs)))
            return rows
        except (UnicodeDecodeError, csv.Error) as error:
            raise RecordingError(f"{path}:{reader.line_num + 1}: not a text of UTF-8 with commas: {error}") from None


def _entry(path: Path, line: int, cells: dict, drive) -> Entry:
    at = f"{path}:{line}"
    name = cells["recording"]
    if not name:
        raise RecordingError(f"{at}: column 'recording': empty; expected a file name or address")
    chosen = _beside(path, cells["drive"]) if cells.get("drive") else drive
    if chosen is None:
        raise RecordingError(f"{at}: column 'drive': empty or missing, and there is no --drive drive.toml")
    if not Path(chosen).is_file():
        raise RecordingError(f"{at}: column 'drive': {chosen}: no such file; expected a drive file")
    more = {k: v for k, v in cells.items() if k not in KNOWN and v}
    time, temperature = _time(at, cells.get("time", "")), _number(at, cells.get("temperature", ""))
    return Entry(name, _beside(path, name), str(chosen), cells.get("serial") or name, time, temperature, more)


def _beside(path: Path, name: str) -> str:
    """A path of a manifest, from its folder."""
    return name if remote(name) else str(path.parent / name)


def _time(at, text) -> datetime.datetime | None:
    """A time of the manifest in UTC; one without a zone is taken as UTC."""
    if not text:
        return None
    try:
        found = datetime.datetime.fromisoformat(text.replace("Z", "+00:00"))
    except ValueError:
        raise RecordingError(f"{at}: column 'time': {text!r} is no time; expected ISO 8601 such as {EXAMPLE}") from None
    utc = datetime.timezone.utc
    return found.replace(tzinfo=utc) if found.tzinfo is None else found.astimezone(utc)


def _number(at, text) -> float | None:
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        raise RecordingError(f"{at}: column 'temperature': {text!r} is no number; expected degrees Celsius") from None
