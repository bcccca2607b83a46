# SPDX-License-Identifier: BSD-3-Clause
"""A limit on the memory for reading one file.

Readers check the sizes that a file declares (limits.py).  This limit catches the rest, such as compressed data that
unpack to a thousand times their size: the allocation fails, and the file is rejected.
"""

from __future__ import annotations

import contextlib


@contextlib.contextmanager
def limited_memory(limit: int):
    """Within the block, allocations beyond ``limit`` more bytes fail; no limit on systems without this function."""
    try:
        import resource
    except ImportError:  # not a POSIX system
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = _address_space() + limit
    if soft != resource.RLIM_INFINITY:
        most = min(most, soft)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _address_space() -> int:
    """Bytes of address space in use."""
    try:
        with open("/proc/self/statm") as file:
            import resource

            return int(file.read().split()[0]) * resource.getpagesize()
    except (OSError, ValueError):
        return 4 << 30
