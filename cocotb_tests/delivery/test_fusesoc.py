# SPDX-License-Identifier: BSD-3-Clause
"""fluxproof.core in FuseSoC: lint and simulation run, the projects for yosys and Vivado are complete."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from fluxproof.checkout import ROOT
from fluxproof.cosim import verilog
from fluxproof.cosim.entity import read_entity
from fluxproof.cosim.sources import rtl_sources
from scripts.package import axi_top, fusesoc_core, yosys_tcl


def fusesoc(folder: Path, target: str, *options: str, path: str = "") -> subprocess.CompletedProcess:
    """`fusesoc run` as described in the header of fluxproof.core."""
    command = [
        "fusesoc",
        f"--cores-root={ROOT}",
        "run",
        f"--build-root={folder}",
        f"--target={target}",
        *options,
    ]
    environment = {**os.environ, "PATH": f"{path}{os.environ['PATH']}"}
    return subprocess.run([*command, fusesoc_core.vlnv()], cwd=folder, capture_output=True, text=True, env=environment)


def test_core_file_lists_every_source():
    listed = re.findall(r"- (rtl/\S+)", fusesoc_core.PATH.read_text())
    assert listed == axi_top.source_names()
    assert {ROOT / name for name in listed} == set(rtl_sources())


@pytest.mark.slow
def test_fusesoc_lint(tmp_path):
    done = fusesoc(tmp_path, "lint")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "elaborate fluxproof_axi" in done.stdout + done.stderr


@pytest.mark.slow
def test_fusesoc_lint_of_the_board(tmp_path):
    done = fusesoc(tmp_path, "lint_board")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "elaborate fluxproof_board" in done.stdout + done.stderr


@pytest.mark.slow
def test_fusesoc_vivado_setup_of_the_board(tmp_path):
    done = fusesoc(tmp_path, "vivado_board", "--setup")
    assert done.returncode == 0, done.stderr[-2000:]
    (script,) = tmp_path.glob("*/vivado_board/*0.tcl")
    for text in ("ENCODER=1", "CURRENTS=1", "SPI_LINES=4", "fluxproof.xdc}", "fluxproof_board.xdc}", "fluxproof_board"):
        assert text in script.read_text()


@pytest.mark.slow
def test_fusesoc_sim(tmp_path):
    done = fusesoc(tmp_path, "sim")
    assert done.returncode == 0 and "report note): passed" in done.stdout + done.stderr, done.stdout[-2000:]


def test_fusesoc_vivado_setup(tmp_path):
    done = fusesoc(tmp_path, "vivado", "--setup")
    assert done.returncode == 0, done.stderr[-2000:]
    (script,) = tmp_path.glob("*/vivado/*0.tcl")
    read = re.findall(r"read_vhdl -vhdl2008 \{(\S+)\}", script.read_text())
    assert [name.split("/", 2)[2] for name in read] == axi_top.source_names()
    assert all((script.parent / name).exists() for name in read)
    for text in ("CARRIER_HALF=10000", "fluxproof.xdc}", "clock.tcl}"):
        assert text in script.read_text()
    text = script.read_text()
    assert text.index("CLOCK_HZ=200000000") < text.index("source {") and text.count("source {") == 1


def test_fusesoc_synth_setup(tmp_path):
    """Up to edalize's script: the Verilog exists, and the yosys commands are as expected."""
    if shutil.which("tclsh") is None:
        pytest.skip("there is no tclsh here")
    try:
        verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))
    done = fusesoc(tmp_path, "synth", "--setup")
    assert done.returncode == 0, done.stderr[-2000:]
    (script,) = tmp_path.glob("*/synth/edalize_yosys_template.tcl")
    (converted,) = tmp_path.glob("*/synth/src/*/fluxproof_axi.v")
    text = converted.read_text()
    pins = read_entity(axi_top.PATH).pins
    header = re.search(r"^module fluxproof_axi\s*\((.*?)\);", text, re.MULTILINE | re.DOTALL)[1]
    assert set(re.findall(r"(\w+)(?:,|$)", header)) == set(pins)
    commands = yosys_tcl.commands(script)
    assert f"read_verilog {converted.relative_to(script.parent)}" in commands
    assert "synth_xilinx -family xc7 -flatten -top fluxproof_axi" in [" ".join(c.split()) for c in commands]
    assert any(c.startswith("write_json") for c in commands)
