# SPDX-License-Identifier: BSD-3-Clause
"""House style: vsg on the VHDL, ruff and pyright on the Python; the same as `make lint`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from fluxproof.checkout import ROOT

LICENCE = "SPDX-License-Identifier: BSD-3-Clause"
FOLDERS = ("bd", "cocotb_tests", "docs", "fluxproof", "golden_model", "rtl", "scripts", "studies", "tb", "xgui")
SOURCES = {".c", ".cpp", ".css", ".h", ".html", ".j2", ".py", ".rdl", ".sh", ".sv", ".tcl", ".vhd", ".xdc"}


def run(command: list[str]) -> None:
    if shutil.which(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed")
    # pyright asks no registry for a newer version of itself.
    environment = {**os.environ, "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-1000:]


@pytest.mark.slow
def test_vhdl_style():
    sources = sorted((ROOT / "rtl").rglob("*.vhd")) + sorted((ROOT / "tb").glob("*.vhd"))
    run(["vsg", "-c", "vsg.yaml", "-f", *(str(s) for s in sources if s.name != "fluxproof_pkg.vhd")])


def test_python_style():
    run(["ruff", "check", "."])
    run(["ruff", "format", "--check", "."])


@pytest.mark.slow
def test_types():
    run(["pyright", "--project", str(ROOT), "--pythonpath", sys.executable])


def test_every_source_file_names_its_licence():
    """In the first line, or in the second below what must be the first."""
    sources = [f for name in FOLDERS for f in (ROOT / name).rglob("*") if f.suffix in SOURCES]
    sources += [ROOT / "Makefile", ROOT / ".ci" / "run", ROOT / "fluxproof.core"]
    assert len(sources) > 900
    assert [str(f.relative_to(ROOT)) for f in sources if LICENCE not in "".join(f.open().readlines()[:2])] == []
