# SPDX-License-Identifier: BSD-3-Clause
"""Results of several files enter their folder together or not at all.

    with together(out, ("report.html", "drive_improved.toml")) as stage:
        write_text(stage / "report.html", page)

The files are written into a hidden folder inside ``out``, .fluxproof-new-…, on the same file system.  At the end it is
renamed to .fluxproof-done-…: from then on the new result counts.  Then each file is moved into ``out``, and each owned
name that was not written is removed.  A process that is killed before the renaming leaves the earlier result as it was;
one that is killed afterwards leaves .fluxproof-done-…, and the next one that writes into ``out`` finishes the moves.
The hidden folder is locked by the process that fills it, so that the next one knows and removes what has no owner.

A hidden folder counts as ours only if the plan in it names the folder's own place on the disk (device and inode): one
that came with a stranger's archive cannot know it, and is left alone.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import signal
import stat
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from fluxproof.files import direct, naming
from golden_model.regular_file import open_regular

try:
    import fcntl
except ImportError:  # no such locks on this system: nothing is removed that may be in use
    fcntl = None

NEW, DONE = ".fluxproof-new-", ".fluxproof-done-"
PLAN = ".plan.json"  # in the hidden folder: its place on the disk, and the names that the finished result no longer has
MOST_PLAN = 100_000  # bytes
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextlib.contextmanager
def together(out: str | os.PathLike, owned: Sequence[str] = ()) -> Iterator[Path]:
    """A folder for files that enter ``out`` when the block ends; after an exception ``out`` is as it was before.

    owned: the names that a result of this command may have; those that the block did not write are removed.
    Raises OSError, with the name in ``out``, if something cannot be written.
    """
    out, stage, lock = Path(out), None, None
    made = [folder for folder in (out, *out.parents) if not folder.exists()]
    try:
        with uninterrupted():
            stage, lock = _opened(out)
        _refuse_folders(out, owned)
        yield stage
        with uninterrupted():
            _enter(stage, out, owned)
    except BaseException as error:
        with uninterrupted():
            if stage is not None:
                shutil.rmtree(stage, ignore_errors=True)
            for folder in made:
                with contextlib.suppress(OSError):  # another process may use it by now
                    folder.rmdir()
        if isinstance(error, OSError) and stage is not None and isinstance(error.filename, str):
            error.filename = error.filename.replace(str(stage), str(out))
        raise
    finally:
        _close(lock)


def check(out: str | os.PathLike, owned: Sequence[str] = ()) -> None:
    """OSError, before a long work, if ``together`` could not write into ``out``; nothing is left there."""

    class Tried(Exception):
        pass

    with contextlib.suppress(Tried), together(out, owned):
        raise Tried


@contextlib.contextmanager
def alone(path: Path) -> Iterator[Path]:
    """A name to write one file to, which becomes ``path`` when the block ends; see ``together``."""
    if direct(path):
        yield path
        return
    with together(path.parent) as stage:
        yield stage / path.name


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Ctrl-C, SIGTERM and SIGHUP act when the block has ended.  Only the main thread receives them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held = []
    before = {number: signal.signal(number, lambda n, _: held.append(n)) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in reversed(before.items()):  # Ctrl-C last, which may raise from then on
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for number in held:
            signal.raise_signal(number)


def _opened(out: Path) -> tuple[Path, int | None]:
    """(a new hidden folder in ``out``, its lock), after what killed processes left has been settled."""
    if out.exists() and not out.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(out))
    out.mkdir(parents=True, exist_ok=True)
    lock = _locked(out)
    try:
        _settle(out)
        with naming(out):
            stage = Path(tempfile.mkdtemp(prefix=NEW, dir=out))
            handle = _locked(stage)  # before the plan is there, by which the next process would take it for left behind
            _write_plan(stage, [])
        return stage, handle
    finally:
        _close(lock)


def _enter(stage: Path, out: Path, owned: Sequence[str]) -> None:
    """The renaming that decides, then the moves."""
    lock = _locked(out)
    try:
        _finish(out)
        written = {path.name for path in stage.iterdir()} - {PLAN}
        _refuse_folders(out, written)
        with naming(out):
            _write_plan(stage, [name for name in owned if name not in written])
        os.rename(stage, out / stage.name.replace(NEW, DONE, 1))
        _finish(out)
    finally:
        _close(lock)


def _settle(out: Path) -> None:
    """Finish the moves of a killed process and remove the hidden folders of those that no longer run."""
    _finish(out)
    for left in out.glob(f"{NEW}*"):
        if _plan(left) is None or (lock := _locked(left, seconds=0.0)) is None:
            continue
        shutil.rmtree(left, ignore_errors=True)
        _close(lock)


def _finish(out: Path) -> None:
    """Move what a finished hidden folder holds into ``out``; can be repeated after an interruption at any point."""
    for done in sorted(out.glob(f"{DONE}*")):
        if (removals := _plan(done)) is None:
            continue
        for name in removals:
            (out / name).unlink(missing_ok=True)
        for path in sorted(done.iterdir()):
            if path.name != PLAN:
                os.replace(path, out / path.name)
        shutil.rmtree(done)


def _write_plan(stage: Path, removals: list[str]) -> None:
    (stage / PLAN).write_text(json.dumps({"place": _place(stage), "remove": removals}))


def _plan(folder: Path) -> list[str] | None:
    """The names to remove of a hidden folder that this command made here; None for any other folder or file."""
    try:
        if not _mine(folder):
            return None
        with open_regular(folder / PLAN) as file:
            plan = json.loads(file.read(MOST_PLAN))
        return plan["remove"] if plan["place"] == _place(folder) else None
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return None


def _place(folder: Path) -> list[int]:
    found = folder.lstat()
    return [found.st_dev, found.st_ino]


def _refuse_folders(out: Path, names) -> None:
    """IsADirectoryError for a result whose name a folder has, before the work and not in the middle of the moves."""
    for name in names:
        if (out / name).is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(out / name))


def _mine(folder: Path) -> bool:
    """Whether it is a folder of this user and no link: others may write into /tmp as well."""
    try:
        found = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(found.st_mode) and (not hasattr(os, "geteuid") or found.st_uid == os.geteuid())


def _locked(folder: Path, seconds: float = 10.0) -> int | None:
    """A handle that locks a folder until it is closed; None if another process keeps it or there are no such locks.

    The moves take milliseconds; whoever keeps the lock for longer, such as flock(1) around this command, is no run.
    """
    if fcntl is None:
        return None
    handle, end = os.open(folder, os.O_RDONLY), time.monotonic() + seconds
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return handle
        except OSError as error:
            if not isinstance(error, BlockingIOError) or time.monotonic() >= end:
                os.close(handle)
                return None
        time.sleep(0.01)


def _close(handle: int | None) -> None:
    if handle is not None:
        os.close(handle)
