# SPDX-License-Identifier: BSD-3-Clause
"""Makes the content of a find smaller: leaves out lines or blocks as long as the same fault stays (delta debugging)."""

from __future__ import annotations

import time
from collections.abc import Callable

LEAST = 8  # bytes of a block of a file that is no text


def smaller(content: bytes, fails: Callable[[bytes], bool], seconds: float) -> bytes:
    """The smallest content found in so many seconds for which ``fails`` is true."""
    stop = time.monotonic() + seconds
    text = b"\0" not in content and content.count(b"\n") > 1
    parts = content.splitlines(keepends=True) if text else _blocks(content)
    count = 2
    while len(parts) > 1 and time.monotonic() < stop:
        size = max(1, len(parts) // count)
        for start in range(0, len(parts), size):
            rest = parts[:start] + parts[start + size :]
            if rest and time.monotonic() < stop and fails(b"".join(rest)):
                parts, count = rest, max(2, count - 1)
                break
        else:
            if size == 1:
                break
            count = min(2 * count, len(parts))
    return b"".join(parts)


def _blocks(content: bytes) -> list[bytes]:
    size = max(LEAST, len(content) // 512)
    return [content[k : k + size] for k in range(0, len(content), size)]
