# SPDX-License-Identifier: BSD-3-Clause
"""``@kernel``: a function that runs as plain Python and, compiled by numba, a thousand times faster.

The compiled code is cached on disk.  numba notices a change of the kernel's own file but
not of the files it calls, so the name of the cache folder is a hash of the whole package: a stale
kernel cannot be loaded.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar

import numba
from numba.core import config

PACKAGE = Path(__file__).resolve().parent
SETTINGS: Any = config  # numba makes its attributes at run time
P = ParamSpec("P")
R_co = TypeVar("R_co", covariant=True)


class Kernel(Protocol[P, R_co]):
    """A compiled function; ``py_func`` is the same as plain Python."""

    @property
    def py_func(self) -> Callable[P, R_co]: ...

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R_co: ...


def source_hash(folder: Path) -> str:
    """Hash of all Python files of a folder, and of numba's version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_root() -> Path:
    """build/ of a checkout; for an installed package the user's cache folder, else a private temporary one."""
    if (PACKAGE.parent / "pyproject.toml").is_file() and os.access(PACKAGE.parent, os.W_OK):
        return PACKAGE.parent / "build"
    try:
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fluxproof"
        cache.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # read-only, or a user without a home
        return _private(Path(tempfile.gettempdir()) / f"fluxproof-{_user()}")
    return cache


def _private(folder: Path) -> Path:
    """The folder if it is this user's alone, else a new one: numba unpickles its cache, which others must not write."""
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = os.lstat(folder)
        if stat.S_ISDIR(found.st_mode) and found.st_uid == _user() and not found.st_mode & 0o022:
            return folder
    except OSError:  # a file of that name
        pass
    return Path(tempfile.mkdtemp(prefix="fluxproof-"))


def _user() -> int:
    return getattr(os, "getuid", lambda: 0)()


CACHE_DIR = _cache_root() / "numba" / source_hash(PACKAGE)


def kernel(function: Callable[P, R_co], cache_dir: Path = CACHE_DIR) -> Kernel[P, R_co]:
    """Compile ``function`` with numba on first call; ``function.py_func`` stays plain Python.

    A kernel outside this package that calls code outside this package needs a ``cache_dir`` of its own,
    named after a hash of everything it calls.
    """
    previous = SETTINGS.CACHE_DIR
    SETTINGS.CACHE_DIR = str(cache_dir)
    try:
        # Nobody takes a kernel's address as that of a C function: compiling the wrapper for it would cost a tenth more.
        options: Any = {"cache": True, "no_cfunc_wrapper": True}
        compiled: Any = numba.njit(**options)(function)
        return compiled
    finally:
        SETTINGS.CACHE_DIR = previous
