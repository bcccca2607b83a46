# SPDX-License-Identifier: BSD-3-Clause
"""The script that `make` sets up, and other ways to start the command: `fleet` with two workers, Ctrl-C."""

from __future__ import annotations

import subprocess
import sys

import pyarrow.parquet as pq
import pytest

from cocotb_tests.support.processes.commands import STOPPED, write_inputs
from cocotb_tests.support.processes.moments import Moment, run
from fluxproof.checkout import ROOT
from fluxproof.fleet import engine


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    return write_inputs(tmp_path_factory.mktemp("inputs"))


@pytest.fixture
def script(tmp_path):
    """bin/fluxproof as scripts/setup/venv.sh writes it; its python is that of the tests."""
    environment = tmp_path / "venv"
    (environment / "bin").mkdir(parents=True)
    (environment / "site").mkdir()
    python = environment / "bin" / "python"
    python.write_text(
        f'#!/bin/sh\ncase "$2" in *purelib*) echo "{environment}/site" ;;\n*) exec "{sys.executable}" "$@" ;; esac\n'
    )
    python.chmod(0o755)
    names = f'root="{ROOT}" venv="{environment}"; . "{ROOT}/scripts/setup/venv.sh"; add_commands "$venv"'
    subprocess.run(["bash", "-euc", names], check=True)
    assert (environment / "site" / "fluxproof.pth").read_text() == f"{ROOT}\n"
    return environment / "bin" / "fluxproof"


def fleet_of(program, inputs, tmp_path) -> None:
    """`fleet` with two workers: a row for each recording."""
    out = tmp_path / "out"
    recordings = [inputs / "stopped.csv", inputs / "stopped_too.csv"]
    arguments = ["fleet", *recordings, "--drive", inputs / "drive.toml", "--out", out, "--workers", "2", "--quiet"]
    done = run(tmp_path, arguments, program=program, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    rows = pq.read_table(out / "fleet.parquet").to_pylist()
    assert [row["verdict"] for row in rows] == ["bad_recording"] * 2, [row["reason"] for row in rows]


@pytest.mark.slow
def test_the_script_of_the_set_up_runs_a_fleet(script, inputs, tmp_path):
    fleet_of([script], inputs, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["module", "script without a guard"])
def test_other_ways_to_start_a_fleet(form, inputs, tmp_path):
    program = [sys.executable, "-m", "fluxproof"]
    if form != "module":
        (tmp_path / "start.py").write_text("import sys\nfrom fluxproof.command import main\nsys.exit(main())\n")
        program = [sys.executable, tmp_path / "start.py"]
    fleet_of(program, inputs, tmp_path)


def test_workers_do_not_know_the_script(monkeypatch):
    module = sys.modules["__main__"]
    monkeypatch.setattr(module, "__spec__", None)
    monkeypatch.setattr(module, "__file__", "start.py", raising=False)
    hidden = engine._Main()
    assert not hasattr(module, "__file__")
    hidden.restore()
    assert module.__file__ == "start.py"


def test_the_script_of_the_set_up_ends_as_the_module_does(script, tmp_path):
    done = run(tmp_path / "hook", ["--help"], program=[script])
    assert done.returncode == 0 and "registers" in done.stdout
    done = run(tmp_path / "hook", ["registers", "none.toml"], Moment("import", "fluxproof.command"), [script])
    assert (done.returncode, done.stderr) == (130, STOPPED)
