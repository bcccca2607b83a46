"""Reads a recording's file into a Table; the format is recognised by content and must agree with the file name.

Files are untrusted: nothing in them is executed (no pickles), links to other files are not followed, and sizes are
checked before memory is allocated.  Any exception of a parsing library becomes a RecordingError of one line.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import pkgutil
import stat
import sys
import warnings
from pathlib import Path

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.memory import limited_memory
from fluxproof.diagnosis.readers.table import Select, Table, shown

HEAD_BYTES = 4096


def readers() -> list:
    """All reader modules of this folder; text last, since any file may look like text."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__))
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    return sorted((m for m in modules if hasattr(m, "read")), key=lambda m: m.FORMAT == "text")


def read_table(path, select: Select | None = None) -> Table:
    """The file's columns; RecordingError names the file and what was expected."""
    path = Path(path)
    head = _head(path)
    reader = _reader_of(path, head)
    with warnings.catch_warnings(), limited_memory(), _quiet_finalizers():
        warnings.simplefilter("ignore")  # a damaged file leads to findings or errors of this package instead
        try:
            return reader.read(path, select)
        except RecordingError as error:
            if str(path) in str(error):
                raise
            failure = str(error)
        except MemoryError:
            failure = "too large for the memory limit"
        except (Exception, SystemExit) as error:  # parsing libraries raise anything on damaged content
            first = (str(error).strip().splitlines() or [type(error).__name__])[0]
            failure = f"not a readable {reader.FORMAT} file: {shown(first, 160)}"
        gc.collect(1)  # what the library left half made is young; a search of everything would take a second
    raise RecordingError(f"{path}: {failure}")


@contextlib.contextmanager
def _quiet_finalizers():
    """Suppress tracebacks that incomplete objects of a parsing library print when they are deleted."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        yield
    finally:
        sys.unraisablehook = hook


def _head(path: Path) -> bytes:
    """The first bytes of an ordinary, non-empty file."""
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode):
            raise RecordingError(f"{path}: not a file")
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES)
    except (OSError, ValueError) as error:
        if isinstance(error, RecordingError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(f"{shown(path, 200)}: cannot be read: {reason}") from None
    if not head:
        raise RecordingError(f"{path}: the file is empty")
    return head


def _reader_of(path: Path, head: bytes):
    """The reader for the content; RecordingError if the file name claims another format."""
    known = readers()
    found = next((m for m in known if m.matches(head, path)), None)
    suffix = path.suffix.lower()
    claims = [m for m in known if suffix in m.SUFFIXES]
    if found is None:
        formats = ", ".join(m.FORMAT for m in known)
        claimed = f"not a {claims[0].FORMAT} file, as its name suggests" if claims else "unknown format"
        raise RecordingError(f"{path}: {claimed}; readable formats: {formats}")
    if claims and found not in claims:
        raise RecordingError(
            f"{path}: the name suggests {claims[0].FORMAT}, the content is {found.FORMAT}; rename it if that is right"
        )
    return found
