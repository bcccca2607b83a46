# SPDX-License-Identifier: BSD-3-Clause
"""Which recordings there are: folders, globs, files, addresses of object stores, and manifests (CSV or Parquet).

A manifest has a column ``recording`` and may have ``drive`` (drive file), ``serial``, ``time`` (ISO 8601),
``temperature`` (degC) and any others, which are kept as text.  Relative paths are relative to the manifest's folder.
"""

from __future__ import annotations

import contextlib
import datetime
import glob
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers import readers
from fluxproof.fleet.addresses import check_address, matching, remote, spelled
from fluxproof.fleet.manifest_file import is_manifest, table
from fluxproof.quote import shown
from golden_model.regular_file import open_regular

KNOWN = ("recording", "drive", "serial", "time", "temperature")
EXAMPLE = "2026-11-25T08:00:00"


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


def entries(sources: list[str], drive: str | None, allowed: Iterable[str] = ()) -> list[Entry]:
    """All recordings of the command line, sorted by name; drive: the drive file where a manifest names none.

    allowed: protocols that addresses of a manifest may have beside those of files on this machine.
    Raises RecordingError: nothing found, a manifest's line and column with what was expected, a recording named twice.
    """
    out = []
    for source in sources:
        out += _of(source, drive, frozenset(allowed))
    if not out:
        raise RecordingError(f"{', '.join(sources)}: no recording found")
    seen: dict[str, Entry] = {}
    for entry in out:
        other = seen.setdefault(entry.name, entry)
        if other is not entry and other != entry:
            twice = f"{entry.name} is named twice, with different drive file, serial number or time"
            raise RecordingError(f"{', '.join(sources)}: {twice}")
    for chosen, entry in {entry.drive: entry for entry in seen.values()}.items():
        _check_drive(f"{chosen}: drive file of {entry.name}", chosen)
    return sorted(seen.values(), key=lambda e: e.name)


def _of(source: str, drive, allowed) -> list[Entry]:
    if remote(source):
        check_address(source)
        return [_plain(path, drive) for path in _remote(source)]
    path = Path(source)
    if path.is_dir():
        return [_plain(str(p), drive) for p in _files(path) if _is_recording(p)]
    if path.is_file():
        return _file(path, source, drive, allowed)
    if path.exists():
        with _readable(path):
            open_regular(path)  # says what it is instead
    found = _matching(source)
    if not found:
        raise RecordingError(f"{source}: no such file or folder, and no file matches it")
    out = []
    for name in found:
        if name.is_dir():
            out += [_plain(str(p), drive) for p in _files(name) if _is_recording(p)]
        else:
            out += _file(name, str(name), drive, allowed)
    return out


def _file(path: Path, source: str, drive, allowed) -> list[Entry]:
    """The recordings of a manifest, or the file itself; what is no file becomes a recording whose row says so."""
    return _manifest(path, drive, allowed) if is_manifest(path) else [_plain(source, drive)]


def _plain(path: str, drive) -> Entry:
    if drive is None:
        raise RecordingError(f"{path}: --drive drive.toml is missing, and no manifest names a drive file")
    return Entry(spelled(path), path, str(drive), spelled(path))


@contextlib.contextmanager
def _readable(path):
    try:
        yield
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None


def _remote(source: str) -> list[str]:
    """The addresses that a pattern of an object store matches; a folder's files if it ends in /."""
    if source.endswith("/"):
        source += "*"
    if "*" not in source:
        return [source]
    with _readable(source):
        return matching(source)


def _files(folder: Path) -> list[Path]:
    """All files below a folder, sorted; links to folders are not followed, as they may lead back."""

    def stop(error):
        raise error

    with _readable(folder):
        return sorted(Path(at) / name for at, _, names in os.walk(folder, onerror=stop) for name in names)


def _matching(pattern: str) -> list[Path]:
    """What a pattern matches, sorted; ** follows no links to folders, and * matches no hidden files."""
    parts = Path(pattern).parts
    first = next((n for n, part in enumerate(parts) if glob.has_magic(part)), None)
    if first is None:
        return []
    rest = parts[first:]
    hidden = any(part.startswith(".") for part in rest)
    found = {p for p in Path(*parts[:first]).glob(str(Path(*rest)))}
    return sorted(p for p in found if hidden or not any(part.startswith(".") for part in p.parts[first:]))


def _is_recording(path: Path) -> bool:
    """Whether a file of a folder has the suffix of a readable format and is no manifest or hidden file."""
    suffixes = {s for reader in readers() for s in reader.SUFFIXES}
    return not path.name.startswith(".") and path.suffix.lower() in suffixes and not is_manifest(path)


def _manifest(path: Path, drive, allowed) -> list[Entry]:
    return [_entry(path, line, cells, drive, allowed) for line, cells in table(path)]


def _entry(path: Path, line: int, cells: dict, drive, allowed) -> Entry:
    at = f"{path}:{line}"
    name = cells["recording"]
    if not name:
        raise RecordingError(f"{at}: column 'recording': empty; expected a file name or address")
    if remote(name):
        try:
            check_address(name, allowed)
        except RecordingError as error:
            raise RecordingError(f"{at}: column 'recording': {error}") from None
    chosen = _beside(path, cells["drive"]) if cells.get("drive") else drive
    if chosen is None:
        raise RecordingError(f"{at}: column 'drive': empty or missing, and there is no --drive drive.toml")
    _check_drive(f"{at}: column 'drive': {shown(chosen, 200)}", chosen)
    more = {k: v for k, v in cells.items() if k not in KNOWN and v}
    time, temperature = _time(at, cells.get("time", "")), _number(at, cells.get("temperature", ""))
    return Entry(
        spelled(name), _beside(path, name), str(chosen), cells.get("serial") or spelled(name), time, temperature, more
    )


def _check_drive(at: str, chosen) -> None:
    """RecordingError unless it is a regular file."""
    try:
        why = None if Path(chosen).is_file() else "not a regular file" if Path(chosen).exists() else "no such file"
    except OSError as error:
        why = error.strerror
    if why:
        raise RecordingError(f"{at}: {why}; expected a drive file")


def _beside(path: Path, name: str) -> str:
    """A path of a manifest, from its folder."""
    return name if remote(name) else str(path.parent / name)


def _time(at, text) -> datetime.datetime | None:
    """A time of the manifest in UTC; one without a zone is taken as UTC."""
    if not text:
        return None
    try:
        found = datetime.datetime.fromisoformat(text.replace("Z", "+00:00"))
        utc = datetime.timezone.utc
        return found.replace(tzinfo=utc) if found.tzinfo is None else found.astimezone(utc)
    except (ValueError, OverflowError):  # the latter within a day of the years 1 and 9999
        raise RecordingError(
            f"{at}: column 'time': {shown(text)!r} is no time; expected ISO 8601 such as {EXAMPLE}"
        ) from None


def _number(at, text) -> float | None:
    if not text:
        return None
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise RecordingError(f"{at}: column 'temperature': {shown(text)!r} is no number; expected degrees Celsius")
    return found
