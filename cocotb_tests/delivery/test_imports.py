# SPDX-License-Identifier: BSD-3-Clause
"""Directions of imports: the contract of pyproject.toml is fulfilled, and a violation is detected."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fluxproof.checkout import ROOT

PACKAGES = ("fluxproof", "golden_model", "studies", "scripts", "cocotb_tests")


def contract(folder: Path) -> subprocess.CompletedProcess:
    """Run import-linter on the packages of a folder."""
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)


@pytest.fixture(scope="module")
def copy(tmp_path_factory) -> Path:
    """A copy of all Python files, to plant a wrong import in."""
    folder = tmp_path_factory.mktemp("imports")
    only_python = shutil.ignore_patterns("__pycache__", "*.vhd", "*.png", "*.toml", "*.json")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / name, ignore=only_python)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def test_import_direction():
    done = contract(ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("golden_model/fixed.py", "import fluxproof.plant.pmsm"),
        ("fluxproof/plant/pmsm.py", "import golden_model.fixed"),
        ("fluxproof/cosim/scenarios.py", "from fluxproof.diagnosis.inference import fit"),
        ("fluxproof/diagnosis/inference/fit.py", "from scripts import generate"),
        ("fluxproof/diagnosis/balance/misfit.py", "from fluxproof.diagnosis.catalogue import CATALOGUE"),
        ("studies/blind/forms.py", "from cocotb_tests.support import board"),
    ],
)
def test_forbidden_import_is_detected(copy, file, line):
    path = copy / file
    before = path.read_text()
    path.write_text(f"{before}\n{line}\n")
    done = contract(copy)
    path.write_text(before)
    assert done.returncode == 1 and "BROKEN" in done.stdout, done.stdout + done.stderr
