# SPDX-License-Identifier: BSD-3-Clause
"""One recording becomes one row: in any process of any machine, in any order, the same row."""

from __future__ import annotations

import functools
import hashlib
import traceback
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from fluxproof.diagnosis.fleet.prior import design_of
from fluxproof.diagnosis.fleet.row import failed_row, one_line, row_of
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.session import work as diagnosed
from fluxproof.fleet.addresses import MOST_BYTES, blocks, local, opened, remote, stated
from golden_model.drive_keys import DriveError

ROOMS = ("fluxproof/diagnosis", "fluxproof/plant", "fluxproof/cosim", "golden_model")  # a row follows from these,
BESIDE = ("fluxproof/diagnosis/report", "fluxproof/diagnosis/fleet")  # but not from how it or a fleet is shown,
ROW = ("row.py", "hypotheses.py", "schema.py")  # apart from these
# What object stores call the state of a file's content.
MARKS = ("ETag", "etag", "md5Hash", "crc32c", "generation", "content_md5", "CRC", "LastModified", "mtime")


@dataclass(frozen=True)
class Item:
    """What a worker needs: where the recording and its drive file are, and the key of its row."""

    recording: str
    drive: str
    key: str
    design: str = ""
    version: str = ""


@dataclass(frozen=True)
class Result:
    """The row of an item.  lasting: the same input gives it again; otherwise a later run tries once more."""

    item: Item
    row: dict
    lasting: bool = True


def work(item: Item) -> Result:
    """Diagnose one recording; never raises: bad input and defects of the tool become a row with the reason."""
    lasting, folder = True, Path(item.recording).parent
    try:
        nominal = load_nominal(item.drive)
        with local(item.recording) as path:
            folder = path.parent
            worked = diagnosed(path, nominal)
            row = row_of(worked.answer(), worked.decision.posterior)
    except (RecordingError, DriveError) as error:
        row, lasting = failed_row(str(error)), _unchanged(item)  # a file may have been removed or replaced meanwhile
    except (OSError, MemoryError) as error:  # of this machine, not of the recording
        row, lasting = failed_row(f"{type(error).__name__}: {error}"), False
    except Exception as error:  # a defect costs one row
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(where.filename).name}:{where.lineno}"
        row = failed_row(f"{type(error).__name__} in {place}: {one_line(error)}")
    for name in ("reason", "sentence"):  # without the folder: the same recording elsewhere has the same row
        row[name] = row.get(name) and row[name].replace(f"{folder}/", "")
    return Result(item, {**row, "design": item.design, "version": item.version}, lasting)


def _unchanged(item: Item) -> bool:
    """Whether recording and drive file still are what the key of the item was made of."""
    try:
        return key_of(item.recording, item.drive, item.version) == item.key
    except (OSError, ValueError):
        return False


def content(recording: str, limit_s: float | None = None) -> str:
    """Hash of a recording: of its bytes; in an object store of what that says of its content, such as an ETag.

    Raises OSError if it cannot be read within ``limit_s`` seconds.
    """
    if remote(recording):
        info = stated(recording)
        marks = {name: str(info[name]) for name in MARKS if info.get(name) is not None}
        if marks:
            return f"{sorted(marks.items())}, {info.get('size')} bytes"
    digest = hashlib.sha256()
    with opened(recording) as file:
        for block in blocks(file, limit_s, MOST_BYTES if remote(recording) else None):
            digest.update(block)
    return digest.hexdigest()


def design(drive: str) -> str:
    """Hash of a drive file, computed once for each of its states."""
    state = Path(drive).stat()
    return _design(drive, state.st_mtime_ns, state.st_size)


@functools.lru_cache(1024)
def _design(drive, *_) -> str:
    return design_of(drive)


@functools.cache
def version() -> str:
    """The version of the package and a hash of its source, as a diagnosis follows from both."""
    root = Path(__file__).resolve().parents[2]  # both packages are in one folder, of a checkout or of an installation
    digest = hashlib.sha256()
    for folder in (root / room for room in ROOMS):
        for path in sorted(folder.rglob("*.py")):
            if path.parent.relative_to(root).as_posix() in BESIDE and path.name not in ROW:
                continue
            digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    try:
        number = metadata.version("fluxproof")
    except metadata.PackageNotFoundError:  # a checkout
        number = "checkout"
    return f"{number}+{digest.hexdigest()[:8]}"


def key_of(recording: str, drive: str, of_version: str | None = None, limit_s: float | None = None) -> str:
    """The key of a row: a recording, drive file or version that changed has another one."""
    parts = (content(recording, limit_s), design(drive), of_version or version())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]
