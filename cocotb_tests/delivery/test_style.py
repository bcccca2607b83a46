"""House style: vsg on the VHDL, ruff and pyright on the Python; the same as `make lint`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from fluxproof.checkout import ROOT


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


@pytest.mark.slow
def test_types():
    run(["pyright", "--project", str(ROOT), "--pythonpath", sys.executable])
