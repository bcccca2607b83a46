"""The process in which cases run: a crash, a hang or a limit of memory ends it and not the fuzzing."""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import os
import resource
import sys
import warnings
from pathlib import Path

from scripts.fuzz.case import Verdict
from scripts.fuzz.judge import judge
from scripts.fuzz.watch import Watch

ADDRESS_SPACE = 6 << 30  # beyond what the process has at its start


def serve(target_name: str, folder: str, connection) -> None:
    """Judge the file that each message names until the other end closes; first one valid case, which loads libraries."""
    sys.dont_write_bytecode = True
    warnings.simplefilter("ignore")
    log = open(Path(folder, "child.log"), "w")
    for number in (1, 2):  # what libraries print belongs to nobody's terminal
        os.dup2(log.fileno(), number)
    faulthandler.enable(log)
    target = importlib.import_module(target_name)
    inputs = Path(folder, "case")
    inputs.mkdir(exist_ok=True)
    os.environ["TMPDIR"] = str(inputs)
    os.chdir(inputs)
    target.warm(inputs)
    with open("/proc/self/statm") as file:
        most = int(file.read().split()[0]) * resource.getpagesize() + ADDRESS_SPACE
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))
    watch = Watch()
    connection.send(Verdict())
    with contextlib.suppress(EOFError, OSError):
        while True:
            path = Path(connection.recv())
            faulthandler.dump_traceback_later(3 * target.SECONDS, file=log)
            verdict = judge(target, path, watch)
            faulthandler.cancel_dump_traceback_later()
            connection.send(verdict)
