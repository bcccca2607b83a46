# SPDX-License-Identifier: BSD-3-Clause
"""The process in which cases run: a crash, a hang or a limit of memory ends it and not the fuzzing."""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import os
import resource
import signal
import sys
import warnings
from pathlib import Path

from scripts.fuzz.case import Verdict
from scripts.fuzz.judge import judge
from scripts.fuzz.watch import Watch

ADDRESS_SPACE = 6 << 30  # beyond what the process has at its start


def serve(folder: str, connection) -> None:
    """Answer each message (target, path) with a Verdict until the other end closes; an empty path loads the target."""
    log = open(Path(folder, "child.log"), "w")
    for number in (1, 2):  # what libraries print belongs to nobody's terminal
        os.dup2(log.fileno(), number)
    sys.dont_write_bytecode = True
    warnings.simplefilter("ignore")
    faulthandler.enable(log)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    inputs = Path(folder, "case")
    inputs.mkdir(exist_ok=True)
    os.environ["TMPDIR"] = str(inputs)
    os.chdir(inputs)
    watch = Watch()
    with contextlib.suppress(EOFError, OSError):
        while True:
            name, path = connection.recv()
            target = importlib.import_module(name)
            if not path:
                target.warm(inputs)
                _limit_memory()
                connection.send(Verdict())
                continue
            faulthandler.dump_traceback_later(2 * target.SECONDS, repeat=True, file=log)
            verdict = judge(target, Path(path), watch)
            faulthandler.cancel_dump_traceback_later()
            connection.send(verdict)


def _limit_memory() -> None:
    """What a file may make the process take at most, so that the machine goes on; the verdict is by less (judge.py)."""
    with contextlib.suppress(OSError), open("/proc/self/statm") as file:
        most = int(file.read().split()[0]) * resource.getpagesize() + ADDRESS_SPACE
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))
