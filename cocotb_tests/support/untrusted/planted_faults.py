# SPDX-License-Identifier: BSD-3-Clause
"""A target of the fuzzing that does with one byte each what no input may cause, to show that each is noticed."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import socket
import subprocess
import time

import numpy as np
from hypothesis import strategies as st

from fluxproof.diagnosis.ground.recording import RecordingError
from golden_model.drive_keys import DriveError
from scripts.fuzz.case import Case

# Half a gigabyte takes a slow machine two seconds to fill, and "m" is to be found for its memory.
SECONDS, TURN, NAMES_FILE = 5.0, 200, True
ELSEWHERE = "/fluxproof_planted_fault"
kept: list = []


def cases():
    """Letters of the quick faults, and of none."""
    return st.lists(st.sampled_from(b".:;ABekxpw2"), max_size=6).map(lambda content: Case(".bin", bytes(content)))


def run(path) -> None:
    for byte in path.read_bytes():
        if chr(byte) in FAULTS:
            FAULTS[chr(byte)](path)
    raise RecordingError(f"{path}: this is how a file is refused")


def warm(folder) -> None:
    """Nothing is to be loaded."""


def _hidden(function):
    """An error that the code takes for that of a damaged file, as readers do with every exception."""
    with contextlib.suppress(Exception):
        function()


def _raise(error):
    raise error


def _loop(_):
    while True:
        pass


FAULTS = {
    "k": lambda path: {}["no such key"],
    "l": _loop,
    "h": lambda path: time.sleep(60.0),  # takes no processor time
    "e": lambda path: _hidden(lambda: eval("1 + 1")),
    "x": lambda path: _hidden(lambda: exec("pass")),
    "s": lambda path: _hidden(lambda: os.system("true")),
    "p": lambda path: _hidden(lambda: subprocess.run(["true"])),
    "u": lambda path: _hidden(lambda: pickle.loads(b"cposix\ngetpid\n.")),
    "n": lambda path: _hidden(lambda: socket.create_connection(("127.0.0.1", 9), 0.1)),
    "w": lambda path: _hidden(lambda: open(ELSEWHERE, "w")),  # noqa: SIM115
    "r": lambda path: _hidden(lambda: open("/etc/passwd")),  # noqa: SIM115
    "m": lambda path: kept.append(np.ones(60_000_000)),
    "c": lambda path: os.kill(os.getpid(), signal.SIGSEGV),
    "q": lambda path: os._exit(0),
    "2": lambda path: _raise(DriveError(f"{path}: two\nlines")),
    "b": lambda path: _raise(DriveError(f"{path}: \x1b[31m")),
    "t": lambda path: _raise(RecordingError(f"{path}: {'long ' * 300}")),
    "f": lambda path: _raise(RecordingError("no file is named")),
}
EXPECTED = {
    "k": "KeyError", "l": "slow", "h": "hang", "e": "event exec", "x": "event exec", "s": "event os.system",
    "p": "event subprocess.Popen", "u": "event pickle.find_class", "n": "event socket.", "w": "event open",
    "r": "event open", "m": "memory", "c": "crash: SIGSEGV", "q": "crash: status 0", "2": "message of 2 lines",
    "b": "message not printable", "t": "message too long", "f": "message without a file",
}  # fmt: skip
