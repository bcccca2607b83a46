# SPDX-License-Identifier: BSD-3-Clause
"""`njit` with a cache on disk that follows the whole package.

numba renews a cached function when its own file changes, not when a file that
it calls does (a state index in `layout`, say).  Here the name of the cache folder
is a hash of the package, so stale machine code cannot be loaded.  Code
elsewhere that compiles the plant's kernels into its own and caches the result
must include `SOURCE_HASH` in its key.
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


def _source_hash() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(PACKAGE.glob("*.py")):
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


SOURCE_HASH = _source_hash()
CACHE_DIR = _cache_root() / "numba" / SOURCE_HASH


def njit(function: Callable[P, R_co]) -> Kernel[P, R_co]:
    """Compile a function with numba on first call and keep the result on disk."""
    previous = SETTINGS.CACHE_DIR
    SETTINGS.CACHE_DIR = str(CACHE_DIR)
    try:
        compiled: Any = numba.njit(cache=True)(function)
        return compiled
    finally:
        SETTINGS.CACHE_DIR = previous
