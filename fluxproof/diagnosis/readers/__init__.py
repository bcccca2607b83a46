# SPDX-License-Identifier: BSD-3-Clause
"""Reads a recording's file into a Table; the format is recognised by content and must agree with the file name.

Files are untrusted: nothing in them is executed (no pickles, no formulas), links to other files are not followed, and
time and memory are limited by the file's size (limits.py).  Any exception of a parsing library becomes a RecordingError
of one line.  docs/security.md states what each library could do and why it does not.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import pkgutil
import sys
import warnings
from pathlib import Path

from fluxproof.diagnosis.ground.limits import head_of, limited
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.packed import refuse_packed
from fluxproof.diagnosis.readers.table import Select, Table, shown
from fluxproof.quote import escaped


def readers() -> list:
    """All reader modules of this folder; text last, since any file may look like text."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__))
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    return sorted((m for m in modules if hasattr(m, "read")), key=lambda m: m.FORMAT == "text")


def read_table(path, select: Select | None = None, *beside) -> Table:
    """The file's columns; RecordingError names the file and what was expected.

    beside: further files with matrices over the same axes.
    """
    path = Path(path)
    reader = _reader_of(path, head_of(path))
    for library in reader.LIBRARIES:
        with contextlib.suppress(ImportError):  # the reader reports it
            importlib.import_module(library)
    with warnings.catch_warnings(), _quiet(), limited(path):
        warnings.simplefilter("ignore")  # a damaged file leads to findings or errors of this package instead
        try:
            return reader.read(path, select, *beside)
        except RecordingError as error:
            if escaped(path) in str(error):
                raise
            failure = str(error)
        except MemoryError:
            failure = "too large for the memory limit of its size"
        except (Exception, SystemExit) as error:  # parsing libraries raise anything on damaged content
            first = (str(error).strip().splitlines() or [type(error).__name__])[0]
            failure = f"not a readable {reader.FORMAT} file: {shown(first, 160)}"
        gc.collect(1)  # what the library left half made is young; a search of everything would take a second
    raise RecordingError(f"{path}: {failure}")


@contextlib.contextmanager
def _quiet():
    """Suppress what a parsing library prints of a damaged file, also when it deletes its incomplete objects."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        sys.unraisablehook = hook


def _reader_of(path: Path, head: bytes):
    """The reader for the content; RecordingError if the file name claims another format."""
    refuse_packed(path, head)
    known = readers()
    found = next((m for m in known if m.matches(head, path)), None)
    suffix = path.suffix.lower()
    claims = [m for m in known if suffix in m.SUFFIXES]  # the last is the most general
    if found is None:
        formats = ", ".join(m.FORMAT for m in known)
        claimed = f"not a {claims[-1].FORMAT} file, as its name suggests" if claims else "unknown format"
        raise RecordingError(f"{path}: {claimed}; readable formats: {formats}")
    if claims and found not in claims:
        raise RecordingError(
            f"{path}: the name suggests {claims[-1].FORMAT}, the content is {found.FORMAT}; rename it if that is right"
        )
    return found
