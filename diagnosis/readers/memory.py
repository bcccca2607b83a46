"""A bound on what reading one file may take of the machine's memory (no reader itself).

Sizes that a file declares are checked where a reader can; this catches the rest, such as packed data that unpack
to a thousand times their size: the allocation fails, and the file is refused.
"""

from __future__ import annotations

import contextlib

LIMIT_BYTES = 8 << 30


@contextlib.contextmanager
def limited_memory(limit: int = LIMIT_BYTES):
    """Within the block, allocations beyond ``limit`` more bytes fail; no bound on systems that offer none."""
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
