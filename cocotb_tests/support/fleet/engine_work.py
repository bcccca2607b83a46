# SPDX-License-Identifier: BSD-3-Clause
"""Work for the processes of an engine; imports nothing, so that a new process is there at once."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import time


def lasting(number: int) -> int:
    """Work that takes long enough for its process to be killed."""
    time.sleep(0.3)
    return number * number


def fatal(number: int) -> int:
    """Work that ends its process."""
    if number == 2:
        os._exit(1)
    return number


def blocking(number: int) -> int:
    """Work of which item 1 never ends, deaf to signals, and item 3 never ends inside one call of C, which no other
    thread of its process interrupts."""
    if number == 1:
        for one in (signal.SIGTERM, signal.SIGINT):
            with contextlib.suppress(ValueError):  # only the main thread may set it
                signal.signal(one, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})
        time.sleep(1e6)
    if number == 3:
        re.match(r"(a+)+$", "a" * 60 + "b")
    return number * number
