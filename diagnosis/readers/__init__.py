"""Reads a recording's file into a Table: the format is found by the content and must be what the name claims.

Files are data of strangers: nothing in them is executed (no pickles), followed (no links to other files) or
believed (sizes are limited before memory is taken).  Whatever a parsing library raises on a damaged file
ends as RecordingError in one line.
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

from fluxproof.diagnosis.readers.memory import limited_memory
from fluxproof.diagnosis.readers.table import Select, Table, shown
from fluxproof.diagnosis.recording import RecordingError

HEAD_BYTES = 4096


def readers() -> list:
    """Every module of this folder that reads a format; text last, since anything may look like text."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__))
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    return sorted((m for m in modules if hasattr(m, "read")), key=lambda m: m.FORMAT == "text")


def read_table(path, select: Select | None = None) -> Table:
    """The file's columns; RecordingError names the file and what was expected."""
    path = Path(path)
    head = _head(path)
    reader = _reader_of(path, head)
    with warnings.catch_warnings(), limited_memory(), _quiet_finalizers():
        warnings.simplefilter("ignore")  # a damaged file's warnings end as checks or errors of our own
        try:
            return reader.read(path, select)
        except RecordingError as error:
            if str(path) in str(error):
                raise
            failure = str(error)
        except MemoryError:
            failure = "does not fit into memory"
        except (Exception, SystemExit) as error:  # parsing libraries raise anything on damaged content
            first = (str(error).strip().splitlines() or [type(error).__name__])[0]
            failure = f"not a readable {reader.FORMAT} file: {shown(first, 160)}"
        gc.collect()
    raise RecordingError(f"{path}: {failure}")


@contextlib.contextmanager
def _quiet_finalizers():
    """Half-made objects of a parsing library print tracebacks when they are thrown away; not within the block."""
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
    """The reader of the content; a name that claims another format is refused."""
    known = readers()
    found = next((m for m in known if m.matches(head, path)), None)
    suffix = path.suffix.lower()
    claims = [m for m in known if suffix in m.SUFFIXES]
    if found is None:
        formats = ", ".join(m.FORMAT for m in known)
        claimed = f"not a {claims[0].FORMAT} file as its name says" if claims else "unknown format"
        raise RecordingError(f"{path}: {claimed}; what can be read: {formats}")
    if claims and found not in claims:
        raise RecordingError(
            f"{path}: the name says {claims[0].FORMAT}, the content is {found.FORMAT}; rename it if that is right"
        )
    return found
