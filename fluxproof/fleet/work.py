"""One recording becomes one row: in any process of any machine, in any order, the same row."""

from __future__ import annotations

import functools
import hashlib
import tempfile
import traceback
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import fsspec

from fluxproof.diagnosis.fleet.prior import design_of
from fluxproof.diagnosis.fleet.row import failed_row, one_line, row_of
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.session import diagnose
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
            row = row_of(diagnose(path, nominal))
    except (RecordingError, DriveError) as error:
        row = failed_row(str(error))
    except (OSError, MemoryError) as error:  # of this machine, not of the recording
        row, lasting = failed_row(f"{type(error).__name__}: {error}"), False
    except Exception as error:  # a defect costs one row
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(where.filename).name}:{where.lineno}"
        row = failed_row(f"{type(error).__name__} in {place}: {one_line(error)}")
    for name in ("reason", "sentence"):  # without the folder: the same recording elsewhere has the same row
        row[name] = row.get(name) and row[name].replace(f"{folder}/", "")
    return Result(item, {**row, "design": item.design, "version": item.version}, lasting)


def remote(recording: str) -> bool:
    """Whether it is in an object store or an archive, which fsspec opens."""
    return "://" in recording


class local:
    """The path of a recording on this machine; one of an object store is fetched for as long as it is used."""

    def __init__(self, recording: str):
        self.recording, self.folder = recording, None

    def __enter__(self) -> Path:
        if not remote(self.recording):
            return Path(self.recording)
        self.folder = tempfile.TemporaryDirectory(prefix="fluxproof_")
        target = Path(self.folder.name) / self.recording.split("::")[0].rstrip("/").rsplit("/", 1)[-1]
        with fsspec.open(self.recording, "rb") as source, open(target, "wb") as file:
            while block := source.read(1 << 20):
                file.write(block)
        return target

    def __exit__(self, *_):
        if self.folder is not None:
            self.folder.cleanup()


def content(recording: str) -> str:
    """Hash of a recording: of its bytes; in an object store of what that says of its content, such as an ETag."""
    if not remote(recording):
        with open(recording, "rb") as file:
            return _hash(file)
    system, path = fsspec.core.url_to_fs(recording)
    info = system.info(path)
    marks = {name: str(info[name]) for name in MARKS if info.get(name) is not None}
    if marks:
        return f"{sorted(marks.items())}, {info.get('size')} bytes"
    with system.open(path, "rb") as file:
        return _hash(file)


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


def key_of(recording: str, drive: str) -> str:
    """The key of a row: a recording, drive file or version that changed has another one."""
    parts = (content(recording), design(drive), version())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def _hash(file) -> str:
    digest = hashlib.sha256()
    while block := file.read(1 << 20):
        digest.update(block)
    return digest.hexdigest()
