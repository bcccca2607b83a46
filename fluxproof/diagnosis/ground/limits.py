# SPDX-License-Identifier: BSD-3-Clause
"""How much time, memory and how many numbers one file may take, from its size alone.

Numbers: a recording of a drive has at least two phase currents of one bit of news a row among at most eight columns, so
0.25 bit a number, however well it is packed: at most 32 numbers per byte of the file.  Small files may have 4 million.
Time: a file of text takes 2 MB/s on a slow machine; small files get 20 s, as other processes may have the cores.
Memory: three float64 copies of the numbers, four times the file, and what the libraries' threads reserve.
"""

from __future__ import annotations

import contextlib
import os
import signal
import stat
import threading
import time
from collections.abc import Iterator

from fluxproof.diagnosis.ground.memory import limited_memory
from fluxproof.diagnosis.ground.recording import RecordingError

MAX_CELLS = 200_000_000  # 1.6 GB as float64
CELLS_PER_BYTE = 32
FEW_CELLS = 4_000_000  # what every file may have
FEW_SECONDS = 20.0
BYTES_PER_SECOND = 2e6
LIBRARIES = 2 << 30  # bytes of address space
OF_A_CORE = 128 << 20  # bytes of address space that each core's threads reserve
HEAD_BYTES = 4096
AGAIN = 0.5  # s until the alarm is repeated, if a library caught the first


class OutOfTime(BaseException):
    """The time is over; no Exception, so that a library does not take it for one of its own."""


def most_cells(size: int) -> int:
    """The most numbers that are read of a file of ``size`` bytes."""
    return min(MAX_CELLS, max(FEW_CELLS, CELLS_PER_BYTE * size))


def most_bytes(size: int) -> int:
    """The most address space that reading a file of ``size`` bytes may add."""
    return LIBRARIES + OF_A_CORE * (os.cpu_count() or 1) + 3 * 8 * most_cells(size) + 4 * size


def most_seconds(size: int) -> float:
    """The longest that reading a file of ``size`` bytes may take."""
    return FEW_SECONDS + size / BYTES_PER_SECOND


def head_of(path) -> bytes:
    """The first bytes of an ordinary, non-empty file."""
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode):
            raise RecordingError(f"{path}: not a file")
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES)
    except (OSError, ValueError) as error:
        if isinstance(error, RecordingError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(f"{path}: cannot be read: {reason}") from None
    if not head:
        raise RecordingError(f"{path}: the file is empty")
    return head


def check_cells(path, cells: int, what: str = "its columns") -> None:
    """RecordingError if ``what`` declares more numbers than a recording of the file's size can have."""
    size = os.stat(path).st_size
    if cells > most_cells(size):
        raise RecordingError(
            f"{path}: with {what}, {cells} numbers are to be read from {size} bytes; "
            f"a file of this size can have {most_cells(size)}"
        )


@contextlib.contextmanager
def limited(path) -> Iterator[None]:
    """Within the block, memory and time are limited as the file's size allows; RecordingError when the time is over."""
    size = os.stat(path).st_size
    seconds = most_seconds(size)
    try:
        with limited_memory(most_bytes(size)), limited_time(seconds):
            yield
    except OutOfTime:
        raise RecordingError(f"{path}: reading took longer than {seconds:.0f} s, the limit of its size") from None


@contextlib.contextmanager
def limited_time(seconds: float) -> Iterator[None]:
    """Within the block, OutOfTime after ``seconds``, as soon as C code returns; only in the main thread of POSIX.

    An alarm that somebody else set is kept: if it rings earlier it stays, else what remains of it is set again.
    """
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return
    other, other_again = signal.getitimer(signal.ITIMER_REAL)
    if 0.0 < other <= seconds:
        yield
        return
    start = time.monotonic()
    before = signal.signal(signal.SIGALRM, _ring)
    signal.setitimer(signal.ITIMER_REAL, seconds, AGAIN)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL if before is None else before)
        if other:
            left = max(1e-3, other - (time.monotonic() - start))
            signal.setitimer(signal.ITIMER_REAL, left, other_again)


def _ring(number, frame) -> None:
    raise OutOfTime
