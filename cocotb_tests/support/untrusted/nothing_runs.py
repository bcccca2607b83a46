# SPDX-License-Identifier: BSD-3-Clause
"""Watches what Python does while a file is read: no code, no import, no process, no network, no file but that one.

Python's audit events report it, also of what a C extension does through Python; not the files that a C library opens by
itself, as HDF5 does: such files have to be refused.  A hook cannot be removed, so there is one, which records only
inside ``watched``.
"""

from __future__ import annotations

import contextlib
import os
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fluxproof.checkout import ROOT

RUNS = (  # not "compile": NumPy parses a header without running it (ast.literal_eval); what runs is an "exec"
    "exec", "import", "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty", "subprocess.Popen",
    "pickle.find_class", "marshal.loads", "ctypes.dlopen", "socket.connect", "socket.getaddrinfo", "urllib.Request",
    "webbrowser.open",
)  # fmt: skip
_events: list[tuple[str, str]] | None = None


@contextlib.contextmanager
def watched(path) -> Iterator[list[tuple[str, str]]]:
    """Yields the list of (event, what) that are not reading ``path``; call it after a good file of the same format.

    Files of the installed packages and of this project, /proc and the temporary folder's own are no recordings of
    somebody else; what is opened beside ``path`` in its folder is reported.
    """
    global _events  # noqa: PLW0603 a hook cannot be removed
    _hook()
    _events = seen = []
    try:
        yield seen
    finally:
        _events = None
        seen[:] = [event for event in seen if not _harmless(*event, Path(path))]


_hooked = False


def _hook() -> None:
    global _hooked  # noqa: PLW0603
    if not _hooked:
        sys.addaudithook(_record)
        _hooked = True


def _record(event: str, args) -> None:
    if _events is None:
        return
    if event == "import" and args[0] in sys.modules:
        return
    if event in RUNS or event == "open":
        what = args[0] if args else ""
        _events.append((event, os.fsdecode(what) if isinstance(what, (bytes, os.PathLike)) else str(what)[:200]))


def _harmless(event: str, what: str, path: Path) -> bool:
    if event != "open":
        return False
    if what.isdigit() or what.startswith(("/proc/", "/sys/")):
        return True
    opened = Path(what).absolute()
    if opened == path.absolute():
        return True
    installed = [sysconfig.get_path("purelib"), sysconfig.get_path("stdlib"), sys.base_prefix, str(ROOT)]
    temporary = Path(tempfile.gettempdir())
    own = opened == temporary or opened.parent == temporary != path.parent
    return own or any(opened.is_relative_to(folder) for folder in installed if folder)
