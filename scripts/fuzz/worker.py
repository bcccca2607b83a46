# SPDX-License-Identifier: BSD-3-Clause
"""The parent's side of the child: a case goes there as a file, and a child that ends or hangs is a verdict too."""

from __future__ import annotations

import multiprocessing
import os
import re
import shutil
import signal
import tempfile
import time
from pathlib import Path

from scripts.fuzz.case import Case, Verdict

CASES = 2000  # after so many a child is replaced, so that what libraries leave behind does not add up
IDLE = 4.0  # s without any work, after which a child hangs
STARTING = 300.0  # s, in which libraries load and kernels are compiled
LOADED = ["scripts.fuzz.child", "pandas", "scipy.io", "h5py", "pyarrow.parquet", "fluxproof.diagnosis.loading.load"]


class Worker:
    """Runs cases of any target in one process, which loads a target with its first case; close it at the end."""

    def __init__(self):
        self.cases, self.process, self.connection = 0, None, None
        self.loaded: set[str] = set()
        self.folder = Path(tempfile.mkdtemp(prefix="fluxproof-fuzz-"))
        self.context = multiprocessing.get_context("forkserver")
        self.context.set_forkserver_preload(LOADED)

    def verdict(self, target, case: Case) -> Verdict:
        """What became of the case; target: a module of targets/."""
        if self.process is None or self.cases >= CASES:
            self._start()
        if target.__name__ not in self.loaded:
            self._load(target)
        self.cases += 1
        inputs = self.folder / "case"
        _empty(inputs)
        path = inputs / f"{case.key}{case.suffix}"
        path.write_bytes(case.content)
        try:
            self.connection.send((target.__name__, str(path)))
            if self._answers(target.SECONDS):
                return self.connection.recv()
            text = self._log()
            self._stop()
            return Verdict(f"hang at {_place(text)}", text)
        except (EOFError, OSError):
            return self._ended()

    def _answers(self, seconds: float) -> bool:
        """Whether an answer comes; not if the child does nothing for a while, or computes far longer than allowed."""
        busy = first = self._processor_s()
        since = time.monotonic()
        while not self.connection.poll(0.5):
            now, used = time.monotonic(), self._processor_s()
            if used > busy:
                busy, since = used, now
            if now - since > IDLE or used - first > 3.0 * seconds:
                return False
        return True

    def _processor_s(self) -> float:
        """Processor time of the child [s]; the clock on the wall where the system does not say."""
        try:
            fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
            return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        except OSError:
            return time.monotonic()

    def _ended(self) -> Verdict:
        """The verdict on a child that is no more."""
        self.process.join(5.0)
        code, text = self.process.exitcode, self._log()
        self._stop()
        name = signal.Signals(-code).name if code is not None and code < 0 else f"status {code}"
        return Verdict(f"crash: {name} at {_place(text)}", f"the process ended with {name}\n{text}")

    def _start(self) -> None:
        from scripts.fuzz.child import serve

        self._stop()
        self.connection, other = self.context.Pipe()
        self.process = self.context.Process(target=serve, args=(str(self.folder), other), daemon=True)
        self.process.start()
        other.close()
        self.cases = 0

    def _load(self, target) -> None:
        """Have the child load the target and run its valid inputs; RuntimeError if it cannot."""
        _empty(self.folder / "case")
        try:
            self.connection.send((target.__name__, ""))
            if self.connection.poll(STARTING):
                self.connection.recv()
                self.loaded.add(target.__name__)
                return
        except (EOFError, OSError):
            pass
        raise RuntimeError(f"{target.__name__}: the child does not start: {self._log()}")

    def _stop(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.connection.close()
            self.process = None
            self.loaded.clear()

    def _log(self) -> str:
        with open(self.folder / "child.log", errors="replace") as file:
            lines = [line for line in file if not line.startswith("Extension modules:")]  # a line longer than the stack
            return "".join(lines)[-4000:]

    def close(self) -> None:
        self._stop()
        shutil.rmtree(self.folder, ignore_errors=True)


def _empty(folder: Path) -> None:
    """Remove what a case left; the folder stays, as the child is in it."""
    folder.mkdir(exist_ok=True)
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()


def _place(log: str) -> str:
    """The innermost place of the project in what faulthandler wrote, innermost first."""
    at = re.search(r'File "\S*?/((?:diagnosis|fluxproof|golden_model|plant)/\S+)", line (\d+) in (\w+)', log)
    return f"{at[1]}:{at[2]} {at[3]}" if at else "an unknown place"
