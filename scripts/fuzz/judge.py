# SPDX-License-Identifier: BSD-3-Clause
"""Runs one case in the child and says what is wrong with its end: the oracle of the fuzzing.

Right are a result, and RecordingError or DriveError with one printable line that names the file.  Wrong are any other
exception, a forbidden event (watch.py), more processor time or more memory than the target allows.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
import traceback
from pathlib import Path

from fluxproof.checkout import ROOT
from fluxproof.diagnosis.ground.recording import RecordingError
from golden_model.drive_keys import DriveError
from scripts.fuzz.case import Verdict

MOST_CHARACTERS = 1000
MEMORY = 400 << 20  # bytes that any file may take
MEMORY_PER_BYTE = 64  # and for each byte of the file
HARNESS = ("scripts/fuzz/judge.py", "scripts/fuzz/child.py")


class TooSlow(BaseException):
    """Raised inside the code under test; no Exception, so that nothing there takes it for a damaged file."""


def judge(target, path: Path, watch) -> Verdict:
    """The verdict on target.run(path); target: a module of targets/."""
    before, start = _reset_peak(), time.process_time()
    watch.begin(path.parent)
    fault = Verdict()
    try:
        with _limit(target.SECONDS):
            target.run(path)
    except (RecordingError, DriveError) as error:
        fault = _of_message(error, path if target.NAMES_FILE else None)
    except BaseException as error:
        kind = "slow" if isinstance(error, TooSlow) else type(error).__name__
        fault = Verdict(f"{kind} at {_place(error)}", traceback.format_exc(limit=-12))
    finally:
        watch.end()
    taken, peak = time.process_time() - start, _peak() - before
    if watch.seen:
        event, text = watch.seen[0]
        return Verdict(f"event {event} at {_place_of_stack(text)}", text)
    if fault.kind:
        return fault
    if taken > target.SECONDS:
        return Verdict(f"slow: {path.suffix}", f"{taken:.1f} s of processor time; allowed are {target.SECONDS} s")
    if peak > MEMORY + MEMORY_PER_BYTE * path.stat().st_size:
        return Verdict(f"memory: {path.suffix}", f"{peak / 1e6:.0f} MB for a file of {path.stat().st_size} bytes")
    return Verdict()


def _of_message(error, path: Path | None) -> Verdict:
    """Whether the message is what a user can use."""
    text = str(error)
    at = f"{type(error).__name__} at {_place(error)}"
    if len(text.splitlines()) != 1:
        return Verdict(f"message of {len(text.splitlines())} lines, {at}", repr(text))
    if not text.isprintable():
        return Verdict(f"message not printable, {at}", repr(text))
    if len(text) > MOST_CHARACTERS:
        return Verdict(f"message too long, {at}", f"{len(text)} characters: {text[:200]!r}")
    if path is not None and path.parent.name not in text and path.stem not in text:
        return Verdict(f"message without a file, {at}", repr(text))
    return Verdict()


def _place(error: BaseException) -> str:
    """The innermost place of the project in a traceback, as file:line in function."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if f.filename.startswith(str(ROOT)) and not f.filename.endswith(HARNESS)]
    return _named(own[-1]) if own else "an unknown place"


def _named(frame) -> str:
    return f"{os.path.relpath(frame.filename, ROOT)}:{frame.lineno} {frame.name}"


def _place_of_stack(text: str) -> str:
    """The same of a formatted stack."""
    lines = [line.strip() for line in text.splitlines() if f'File "{ROOT}' in line]
    lines = [line for line in lines if not any(name in line for name in HARNESS)]
    return lines[-1].replace(f"{ROOT}/", "") if lines else "an unknown place"


@contextlib.contextmanager
def _limit(seconds: float):
    """TooSlow after so much processor time, as soon as Python code runs again; the parent ends what never returns."""

    def stop(*_):
        raise TooSlow(f"more than {seconds} s of processor time")

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _reset_peak() -> int:
    """Resident bytes now; the kernel's largest value starts again from here (Linux)."""
    with contextlib.suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    return _peak()


def _peak() -> int:
    """The largest number of resident bytes."""
    with contextlib.suppress(OSError), open("/proc/self/status") as file:
        return next((int(line.split()[1]) << 10 for line in file if line.startswith("VmHWM")), 0)
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << (0 if sys.platform == "darwin" else 10)
