# SPDX-License-Identifier: BSD-3-Clause
"""A command started as a user starts it, which gets a signal at a chosen moment of its run.

The moment is an event of Python's audit hooks: ``import`` of a module, ``open`` or ``os.rename`` (os.replace too) of a
file.  The hook comes into the process as sitecustomize.py, so that nothing of the command is replaced.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from fluxproof.checkout import ROOT

HOOK = """
import os, re, sys

event, text, left, number, process = {event!r}, {text!r}, [{after}], {number}, os.getpid()

def hook(name, args):
    if name != event or os.getpid() != process:
        return
    if any(re.search(text, os.fsdecode(arg)) for arg in args if isinstance(arg, (str, bytes, os.PathLike))):
        left[0] -= 1
        if left[0] == -1:
            os.kill(process, number)

sys.addaudithook(hook)
"""


class Moment(NamedTuple):
    """The signal is sent at the event that has the regular expression ``text`` in an argument, after others of it."""

    event: str
    text: str
    after: int = 0
    number: int = signal.SIGINT


def run(folder: Path, arguments: list, moment: Moment | None = None, program=None, **options):
    """The ended process of ``python -m fluxproof`` or of another program; ``folder``: for the hook."""
    paths = [str(ROOT)]
    if moment is not None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "sitecustomize.py").write_text(HOOK.format(**moment._asdict() | {"number": int(moment.number)}))
        paths.insert(0, str(folder))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OPENBLAS_NUM_THREADS": "1"}
    for name in ("FLUXPROOF_DEBUG", "PYTHONUNBUFFERED"):
        environment.pop(name, None)
    command = [*(program or [sys.executable, "-m", "fluxproof"]), *arguments]
    given = dict(cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300)
    return subprocess.run([x if isinstance(x, bytes) else str(x) for x in command], **given | options)


def contents(folder: Path) -> dict[str, bytes] | None:
    """{name: content} of the files of a folder, hidden ones too; None without a folder."""
    if not folder.exists():
        return None
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if not p.is_dir()}
