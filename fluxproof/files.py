# SPDX-License-Identifier: BSD-3-Clause
"""Writing results: to a temporary name first, then renamed, so that no file is incomplete.

Several files of one result enter their folder together with fluxproof.stage.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

NAME_LENGTH = 40  # of the target's name in the temporary one: a file system takes 255 bytes


def write_text(path: Path, text: str) -> Path:
    """Write ``text`` to ``path`` in one step; makes the folder."""
    return write_bytes(path, text.encode("utf-8", "replace"))  # names of files need not be text


def write_json(path: Path, data) -> Path:
    """Write ``data`` as readable JSON in one step."""
    return write_text(path, json.dumps(data, indent=2) + "\n")


def write_bytes(path: Path, data: bytes) -> Path:
    """Write ``data`` to ``path`` in one step; makes the folder.

    A symbolic link at ``path`` is replaced, its target stays as it is.  Devices and pipes, and whatever is in /dev, are
    written directly.  OSError names ``path``; no temporary file remains after any exception.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(data)
    return path


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside ``path``, which takes the place of ``path`` when the block ends without an exception."""
    with naming(path):
        if direct(path):
            yield path
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name[:NAME_LENGTH]}.{os.getpid()}.tmp")
        try:
            yield temporary
            os.replace(temporary, path)
        except BaseException:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Errors of the block name ``path``: the system names a temporary file, or none where the disk is full."""
    try:
        yield
    except OSError as error:
        error.filename, error.filename2 = os.fspath(path), None
        raise


def stem_of(path: str | os.PathLike) -> str:
    """The name of a file without its suffix, as the name of a folder: of "...csv" it would be the parent folder."""
    return Path(path).stem.strip(".") or "recording"


def direct(path: Path) -> bool:
    """Whether it is no place for a file: /dev/stdout may be a link to one, and must stay a link."""
    return path.parent == Path("/dev") or (path.exists() and not path.is_file() and not path.is_dir())


def refuse_overwriting(targets: Iterable[Path], inputs: Iterable[str | os.PathLike | None]) -> None:
    """FileExistsError for a target that is the same file as an input, also by another name or a link."""
    existing = [Path(target) for target in targets if Path(target).exists()]
    for source in inputs if existing else ():
        if not source or not os.path.exists(source):
            continue
        for target in existing:
            if target.samefile(source):
                why = "this is an input of the command and would be overwritten; choose another name or folder"
                raise FileExistsError(errno.EEXIST, why, str(target))
