# SPDX-License-Identifier: BSD-3-Clause
"""The Tcl for Vivado run by tclsh against a stub that knows the commands, the files and the core's pins."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from cocotb_tests.support.vivado.tclsh import stubbed
from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim.sources import rtl_sources
from scripts.package import axi_top, ipxact

VIVADO = ROOT / "scripts" / "vivado"


def test_packaging_script(facts, tmp_path):
    done = stubbed(facts, VIVADO / "package_ip.tcl", str(tmp_path))
    assert done.returncode == 0, done.stderr
    added = re.search(r"^add_files -norecurse 1 \{(.*)\}", done.stdout, re.MULTILINE)[1].split()
    assert set(map(Path, added)) == set(rtl_sources())
    assert f"set_property  version {ipxact.version()} " in done.stdout
    assert "type tclSource bd/bd.tcl" in done.stdout and (tmp_path / "ip" / "bd" / "bd.tcl").exists()
    assert "ipx::check_integrity" in done.stdout and f"-root_dir {tmp_path}/ip" in done.stdout


def test_example_script(facts, tmp_path):
    done = stubbed(facts, VIVADO / "example.tcl", str(tmp_path), "xc7z045ffg900-2")
    assert done.returncode == 0, done.stderr
    assert "create_project -part xc7z045ffg900-2 -force 1 example" in done.stdout
    assert re.search(r"^set_property  CONFIG.CLOCK_HZ 100000000 drive$", done.stdout, re.MULTILINE)
    assert "-offset 0x43C00000 -range 4K" in done.stdout
    for report in ("utilization", "timing", "cdc", "drc"):
        assert f"-file {tmp_path}/reports/{report}.rpt" in done.stdout


def test_example_fills_the_table(facts, tmp_path):
    """The row that the routed example writes has the columns of docs/vivado.md, and the JSON says the same."""
    done = stubbed(facts, VIVADO / "example.tcl", str(tmp_path), "xc7z045ffg900-2")
    assert done.returncode == 0, done.stderr
    row = [cell.strip() for cell in (tmp_path / "result.md").read_text().strip().strip("|").split("|")]
    result = json.loads((tmp_path / "result.json").read_text())
    assert row == [str(value) for value in result.values()]
    assert re.fullmatch(r"20\d\d-\d\d-\d\d", result["date"]) and re.fullmatch(r"unknown|[0-9a-f]+\+?", result["commit"])
    wanted = {"part": "xc7z045ffg900-2", "speed_grade": "-2", "clock_mhz": 100, "wns_ns": 0.5, "tool": "Vivado 2023.2"}
    assert {name: result[name] for name in wanted} == wanted
    page = (ROOT / "docs" / "vivado.md").read_text()
    (header,) = re.findall(r"^\| (Date .*) \|$", page, re.MULTILINE)
    columns = ["Date", "Part", "Speed grade", "Clock (MHz)", "WNS (ns)", "Commit", "Tool"]
    assert [name.strip() for name in header.split("|")] == columns and len(row) == len(columns)


@pytest.mark.parametrize("name", ["fluxproof.xdc", "example.xdc"])
def test_constraints(facts, name):
    done = stubbed(facts, VIVADO / name)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("clock_hz", "period"), [(200000000, "5.000"), (100000000, "10.000"), (150000000, "6.666")])
def test_clock_follows_the_generic(facts, tmp_path, clock_hz, period):
    """What FuseSoC sources: the constraint is that of the project's own CLOCK_HZ."""
    own = tmp_path / "facts.tcl"
    own.write_text(facts.read_text() + f"set generics_of_project {{ADC_BITS=16 CLOCK_HZ={clock_hz} }}\n")
    done = stubbed(own, VIVADO / "clock.tcl", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"add_files -fileset constrs_1 -norecurse 1 {tmp_path}/fluxproof_clock.xdc" in done.stdout
    wanted = f"create_clock -name aclk -period {period} [get_ports aclk]\n"
    assert (tmp_path / "fluxproof_clock.xdc").read_text() == wanted
    own.write_text(facts.read_text() + "set generics_of_project {ADC_BITS=16}\n")
    assert "no CLOCK_HZ" in stubbed(own, VIVADO / "clock.tcl", cwd=tmp_path).stderr


def test_no_constraint_has_a_period_of_its_own():
    """A period that is written down is wrong at every other clock."""
    fixed = [path.name for path in VIVADO.glob("*.xdc") if re.search(r"^create_clock", path.read_text(), re.MULTILINE)]
    assert not fixed


def test_a_clock_that_the_processor_cannot_make_is_refused(facts, tmp_path):
    own = tmp_path / "facts.tcl"
    own.write_text(facts.read_text() + "set fclk_error 1000000\n")
    done = stubbed(own, VIVADO / "example.tcl", str(tmp_path))
    assert done.returncode != 0 and "makes 101000000 Hz out of clock_hz = 100000000" in done.stderr
    assert re.search(r"^set_property  CONFIG.CLOCK_HZ 101000000 drive$", done.stdout, re.MULTILINE)


def test_constraints_name_registers_that_exist():
    """Labels of the top and signals of its blocks, as Vivado names their registers."""
    top = axi_top.PATH.read_text()
    found = 0
    for name in ("fluxproof.xdc", "example.xdc"):
        for label, register in re.findall(r"(\w+)/(\w+)_reg\b", (VIVADO / name).read_text()):
            entity = re.search(rf"^  {label} : entity work\.(\w+)", top, re.MULTILINE)[1]
            assert re.search(rf"\b{register} +<=", (RTL / "io" / f"{entity}.vhd").read_text()), register
            found += 1
    assert found == 3


@pytest.mark.parametrize(
    ("script", "old", "new", "message"),
    [
        ("package_ip.tcl", "update_compile_order", "update_compile_orders", "unknown command: update_compile_orders"),
        ("package_ip.tcl", "fluxproof.xdc", "fluxprof.xdc", "no file"),
        ("package_ip.tcl", "-busif $interface", "-bus $interface", "has no option -bus"),
        ("package_ip.tcl", "ipx::infer_bus_interface irq", "ipx::infer_bus_interface irk", "no port irk"),
        ("example.tcl", "CONFIG.CARRIER_HALF", "CONFIG.CARRIER", "no parameter CONFIG.CARRIER"),
        ("example.tcl", "drive/irq", "drive/interrupt", "no pin interrupt"),
        ("example.tcl", "adc_u_dc position_code trip", "position_code trip", "adc_u_dc is not connected"),
        ("example.tcl", "[file join $out ip]", "[file join $out ip2]", "does not hold"),
        ("example.tcl", "-dict [list CONFIG.NUM_SI 1 CONFIG.NUM_MI 2] $control", "-dict {A 1} $control", "property A"),
        ("package_ip.tcl", "ipx::add_file bd/bd.tcl", "ipx::add_file bd.tcl", "no file bd.tcl"),
        ("result.tcl", "STATS.WNS [get_runs", "PART [get_runs", "impl_1 has no property PART"),
        ("result.tcl", "STATS.WNS [get_runs", "PROGRESS [get_runs", "impl_1 has no worst slack"),
        ("result.tcl", "version -short", "version -brief", "no option -brief"),
    ],
)  # fmt: skip
def test_stub_detects_errors(facts, tmp_path, script, old, new, message):
    """The stub rejects wrong scripts; a stub that accepts everything would prove nothing."""
    for path in ("scripts/vivado", "rtl", "bd"):
        shutil.copytree(ROOT / path, tmp_path / path)
    shutil.copy(ipxact.PATH, tmp_path)
    copy = tmp_path / "scripts" / "vivado" / script
    text = copy.read_text()
    assert old in text
    copy.write_text(text.replace(old, new))
    run = copy if script == "package_ip.tcl" else copy.with_name("example.tcl")
    done = stubbed(facts, run, str(tmp_path / "out"))
    assert done.returncode != 0 and message in done.stderr, done.stderr


def test_dialog_passes_every_generic(facts, tmp_path):
    """xgui: every generic has its field, and its value reaches the model."""
    text = (ROOT / ipxact.XGUI).read_text()
    for name in axi_top.GENERICS:
        assert f'ipgui::add_param $IPINST -name "{name}"' in text
        assert f"proc update_MODELPARAM_VALUE.{name} {{MODELPARAM_VALUE.{name} PARAM_VALUE.{name}}}" in text
    assert text.count("{") == text.count("}")
