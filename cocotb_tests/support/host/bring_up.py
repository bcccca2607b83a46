# SPDX-License-Identifier: BSD-3-Clause
"""docs/software/bring_up.c compiled for a drive."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.checkout import ROOT
from fluxproof.print_registers import c_lines
from golden_model.board_registers import board_set

SOFTWARE = ROOT / "docs" / "software"
STRICT = ("-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic")


def compiled(folder: Path, drive, bus: Path) -> Path:
    """bring_up.c for ``drive`` with the functions of ``bus``."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler here")
    header = "\n".join(c_lines(str(PAPER), drive, board_set(drive))) + "\n"
    (folder / "drive_registers.h").write_text(header)
    program = folder / f"bring_up_{bus.stem}"
    includes = [f"-I{folder}", f"-I{SOFTWARE}"]
    command = [
        compiler,
        *STRICT,
        *includes,
        str(SOFTWARE / "bring_up.c"),
        str(bus),
        "-o",
        str(program),
        "-lm",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program
