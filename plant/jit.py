"""`njit` with a cache on disk that follows the whole package.

numba renews a cached function when its own file changes, not when a file that
it calls does (a state index in `layout`, say).  Here the cache folder is named
after a hash of the package, so stale machine code cannot be loaded.  Code
elsewhere that compiles the plant's kernels into its own and caches the result
must include `SOURCE_HASH` in its key.
"""

import hashlib
import os
import tempfile
from pathlib import Path

import numba

PACKAGE = Path(__file__).resolve().parent


def _source_hash():
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(PACKAGE.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


SOURCE_HASH = _source_hash()
_ROOT = PACKAGE.parent / "build" if os.access(PACKAGE.parent, os.W_OK) else Path(tempfile.gettempdir())
CACHE_DIR = _ROOT / "numba" / SOURCE_HASH


def njit(function):
    """Compile a function with numba on first call and keep the result on disk."""
    previous = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(CACHE_DIR)
    try:
        return numba.njit(cache=True)(function)
    finally:
        numba.config.CACHE_DIR = previous
