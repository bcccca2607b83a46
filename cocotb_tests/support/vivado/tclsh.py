# SPDX-License-Identifier: BSD-3-Clause
"""Tcl for Vivado run by tclsh against a stub."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest


def needs_tclsh() -> None:
    """Skips where there is no Tcl."""
    if shutil.which("tclsh") is None:
        pytest.skip("there is no tclsh here")


def stubbed(facts: Path, script: Path, *arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess:
    """``script`` under stub.tcl."""
    needs_tclsh()
    stub = Path(__file__).with_name("stub.tcl")
    return subprocess.run(
        ["tclsh", str(stub), str(facts), str(script), *arguments], cwd=cwd, capture_output=True, text=True
    )
