# SPDX-License-Identifier: BSD-3-Clause
"""Directions of imports: the contract of pyproject.toml holds, no test imports a test, violations are detected."""

from __future__ import annotations

import ast
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
        ("fluxproof/diagnosis/inference/least_squares.py", "from scripts import generate"),
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


def imported_tests(text: str) -> list[str]:
    """Names of all test modules that a Python text imports, also inside functions."""
    names = []
    if "test_" not in text:  # most files outside of the tests: not worth parsing
        return names
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom):
            names += [node.module or "", *(alias.name for alias in node.names)]
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
    return [name for name in names if any(part.startswith("test_") for part in name.split("."))]


def test_no_module_imports_a_test():
    """What several tests share is in cocotb_tests/support or a conftest.py."""
    paths = [path for name in PACKAGES for path in sorted((ROOT / name).rglob("*.py"))]
    wrong = {str(path.relative_to(ROOT)): found for path in paths if (found := imported_tests(path.read_text()))}
    assert paths and not wrong


@pytest.mark.parametrize(
    "line",
    [
        "from cocotb_tests.core.test_registers import PAPER",
        "from cocotb_tests.core import test_registers as registers",
        "import cocotb_tests.core.test_registers",
        "from .test_registers import PAPER",
        "def late():\n    from cocotb_tests.core.test_registers import PAPER",
    ],
)
def test_an_imported_test_is_detected(line):
    assert imported_tests(line) and not imported_tests(line.replace("test_registers", "drives"))


def test_tests_of_the_diagnosis_are_in_the_folder_of_the_same_name():
    """Each room of fluxproof/diagnosis has its tests in one folder; ``session`` has those of whole diagnoses."""
    package, tests = ROOT / "fluxproof" / "diagnosis", ROOT / "cocotb_tests" / "diagnosis"
    rooms = {path.parent.name for path in package.glob("*/__init__.py")}
    folders = {path.parent.name for path in tests.glob("*/test_*.py")}
    assert folders == rooms | {"session"}
    assert not list(tests.glob("*/*/test_*.py")), "rooms have no rooms"
