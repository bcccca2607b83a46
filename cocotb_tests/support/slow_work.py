"""Work for the processes of an engine; imports nothing, so that a new process is there at once."""

from __future__ import annotations

import os
import time


def slowly(number: int) -> int:
    """Work that takes long enough for its process to be killed."""
    time.sleep(0.3)
    return number * number


def fatal(number: int) -> int:
    """Work that ends its process."""
    if number == 2:
        os._exit(1)
    return number
