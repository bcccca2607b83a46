"""Directions of imports: the contract of pyproject.toml is fulfilled, and a violation is detected."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fluxproof.checkout import ROOT

INSIDE = ("golden_model", "plant", "cosim", "diagnosis")  # inside fluxproof/ once installed
BESIDE = ("studies", "scripts", "cocotb_tests")


def lay_out(folder: Path) -> Path:
    """A copy of all Python files, the folders inside the package as in an installed one."""
    only_python = shutil.ignore_patterns("__pycache__", "*.vhd", "*.png", "*.toml", "*.json")
    for name in ("fluxproof", *BESIDE):
        shutil.copytree(ROOT / name, folder / name, ignore=only_python)
    for name in INSIDE:
        shutil.copytree(ROOT / name, folder / "fluxproof" / name, ignore=only_python)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def contract(folder: Path) -> subprocess.CompletedProcess:
    """Run import-linter on the copy."""
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)


def test_import_direction(tmp_path):
    done = contract(lay_out(tmp_path))
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("fluxproof/golden_model/fixed.py", "import fluxproof.plant.pmsm"),
        ("fluxproof/cosim/scenarios.py", "from fluxproof.diagnosis.inference import fit"),
        ("fluxproof/diagnosis/inference/fit.py", "from scripts import generate"),
        ("studies/blind/forms.py", "from cocotb_tests.support import board"),
    ],
)
def test_forbidden_import_is_detected(tmp_path, file, line):
    path = lay_out(tmp_path) / file
    path.write_text(path.read_text() + f"\n{line}\n")
    done = contract(tmp_path)
    assert done.returncode == 1 and "BROKEN" in done.stdout, done.stdout + done.stderr
