# SPDX-License-Identifier: BSD-3-Clause
"""Notices what an input may never cause: a command, a connection, an unpickled object, evaluated text, a foreign file.

An audit hook of Python sees each of these before it happens, records it and refuses it.  The hook stays for the life of
the process, so that only the child of a fuzzing run has one (worker.py).
"""

from __future__ import annotations

import os
import sys
import sysconfig
import traceback
from pathlib import Path

from fluxproof.checkout import ROOT
from golden_model.kernel import CACHE_DIR

FORBIDDEN = (
    "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.startfile", "os.symlink", "os.link", "os.chmod",
    "subprocess.Popen", "pickle.find_class", "marshal.loads", "socket.connect", "socket.bind", "socket.getaddrinfo",
    "urllib.Request", "ctypes.dlopen", "webbrowser.open",
)  # fmt: skip
CHANGES = ("os.remove", "os.rename", "os.rmdir", "os.mkdir", "os.truncate", "shutil.rmtree")  # allowed in its folder
# Code that these compile is their own: classes from field names, compiled kernels.
COMPILES = (
    "collections",
    "dataclasses.py",
    "enum.py",
    "typing.py",
    "numba",
    "attr",
    "jinja2",
    "importlib",
    "reprlib.py",
)
PLACES = (*sysconfig.get_paths().values(), sys.prefix, sys.base_prefix, *filter(None, [sys.pycache_prefix]))
INSTALLED = tuple({str(Path(p).resolve()) for p in PLACES})
OUR_CLASSES = ("golden_model.", "fluxproof.plant.")  # compiled kernels find the tuples that they return by pickle, in C
OWN_LOADING = ("<frozen importlib", os.path.join("numba", "core", "caching.py"))
SYSTEM = ("/proc/self/", "/proc/cpuinfo", "/proc/meminfo", "/sys/devices/system/", "/dev/null", "/dev/urandom", "/usr/")
SYSTEM += ("/etc/mime.types", "/etc/localtime", "/etc/fonts", "/sys/fs/cgroup", "/proc/stat")


class Watch:
    """``begin`` a case in its folder, then ``seen`` are the forbidden events [(event, details and place)]."""

    def __init__(self, extra: tuple[str, ...] = ()):
        """extra: further folders that may be read."""
        self.folder, self.seen, self.inside = "", [], False
        self.readable = (
            str(ROOT),
            *INSTALLED,
            *SYSTEM,
            f"/proc/{os.getpid()}/",
            *extra,
            *filter(None, map(os.path.realpath, sys.path)),
        )
        sys.addaudithook(self._hook)

    def begin(self, folder: Path) -> None:
        self.folder, self.seen = os.path.realpath(folder), []

    def end(self) -> None:
        self.folder = ""

    def _hook(self, event: str, args: tuple) -> None:
        if not self.folder or self.inside:
            return
        self.inside = True  # what the judgement itself opens is no event
        try:
            fault = self._fault(event, args)
            if not fault:
                return
            self.seen.append((event, f"{fault}\n{''.join(traceback.format_stack(sys._getframe(1), 12))}"))
        finally:
            self.inside = False
        raise PermissionError(f"refused while fuzzing: {event}")

    def _fault(self, event: str, args: tuple) -> str:
        if event == "exec":
            return self._of_code(args[0])
        if event == "open":
            return self._of_open(*args[:3])
        if event in CHANGES and not isinstance(args[0], int):
            return "" if self._own(args[0]) or _of_kernels(args[0]) else f"{event} {args[0]!r}"
        if event == "pickle.find_class" and str(args[0]).startswith(OUR_CLASSES):
            return ""
        return f"{event} {args!r}"[:300] if event in FORBIDDEN and not _inside(OWN_LOADING) else ""

    def _of_code(self, code) -> str:
        """Text made code outside an import: its file name is no file."""
        name = getattr(code, "co_filename", "")
        if not name.startswith("<") or name.startswith("<frozen"):
            return ""
        caller = sys._getframe(3).f_code.co_filename
        if any(part in COMPILES for part in caller.split(os.sep)):
            return ""
        return f"evaluates text as code, {name}, names {getattr(code, 'co_names', ())!r}"[:300]

    def _of_open(self, path, mode, flags) -> str:
        if isinstance(path, int) or path is None:
            return ""
        writes = any(c in (mode or "") for c in "wax+") or (mode is None and (flags or 0) & (os.O_WRONLY | os.O_RDWR))
        if self._own(path):
            return ""
        name = os.path.realpath(os.fsdecode(path))
        if writes:
            return "" if name == os.devnull or _of_kernels(name) else f"opens {name!r} for writing"
        return "" if name.startswith(self.readable) else f"opens {name!r}, which is not the file it was given"

    def _own(self, path) -> bool:
        name = os.path.realpath(os.fsdecode(path))
        return name == self.folder or name.startswith(self.folder + os.sep)


def _of_kernels(path) -> bool:
    """Whether a path belongs to the folder of compiled kernels (golden_model/kernel.py)."""
    return os.path.realpath(os.fsdecode(path)).startswith(str(CACHE_DIR.parent))


def _inside(files: tuple[str, ...]) -> bool:
    """Whether code of one of these files is running: imports and compiled kernels load code that is no input."""
    frame = sys._getframe(3)
    while frame is not None:
        if any(part in frame.f_code.co_filename for part in files):
            return True
        frame = frame.f_back
    return False
