# SPDX-License-Identifier: BSD-3-Clause
"""The AXI top and component.xml: up to date, valid by the schema, consistent with VHDL and register map."""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile

import pytest
from lxml import etree

from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim.entity import read_entity
from fluxproof.cosim.sources import rtl_sources
from scripts.package import __main__ as package_command
from scripts.package import axi_top, board_top, hil_top, ipxact, packaged
from scripts.registers import vhdl
from scripts.registers.compiled import compile_file, words

S = {"s": ipxact.SPIRIT}


def names(elements) -> list[str]:
    """The text of spirit:name of each."""
    return [e.findtext("s:name", namespaces=S) for e in elements]


@pytest.fixture(scope="module")
def component():
    return etree.parse(ipxact.PATH).getroot()


# ---------------------------------------------------------------- generated files


def test_committed_files_are_fresh():
    stale = [path.name for path, text in packaged.files().items() if path.read_text() != text]
    assert not stale, f"{stale}: run `make generate` and commit"


def test_same_files_with_and_without_the_top(tmp_path):
    """The first run, without the top, gives the same files as the second."""
    shutil.copytree(RTL, tmp_path / "rtl")
    (tmp_path / axi_top.PATH.relative_to(RTL.parent)).unlink()
    assert packaged.files(tmp_path / "rtl") == packaged.files()


def test_top_reports_unconnected_ports(tmp_path):
    shutil.copytree(RTL, tmp_path / "rtl")
    path = tmp_path / "rtl" / "fluxproof.vhd"
    text = path.read_text()
    path.write_text(text.replace("    enable          : in", "    live_time : in bit;\n    enable          : in", 1))
    with pytest.raises(ValueError, match=r"nothing drives live_time of core \(fluxproof\)"):
        axi_top.render(tmp_path / "rtl")
    path.write_text(text.replace("    tripped         : out", "    gone : out", 1))
    with pytest.raises(ValueError, match="nothing drives tripped of registers"):
        axi_top.render(tmp_path / "rtl")
    path.write_text(text.replace("    tripped         : out", "    irq, tripped    : out", 1))
    with pytest.raises(ValueError, match="fluxproof.vhd: not understood in entity fluxproof: irq, tripped"):
        axi_top.render(tmp_path / "rtl")


@pytest.mark.parametrize("top", [axi_top.AXI, board_top.BOARD, hil_top.HIL], ids=lambda top: top.name)
def test_top_is_vhdl_93(tmp_path, top):
    """A block design takes no VHDL-2008 top as a module; what it instantiates is empty here, ports as they are."""
    package = (RTL / "generated" / "fluxproof_pkg.vhd").read_text()
    shared = re.findall(r"^  constant \w+_W : (?:positive|natural) := \d+;", package, re.MULTILINE)
    shared += re.findall(r"^  type \w+ is record.*?end record \w+;", package, re.MULTILINE | re.DOTALL)
    context = "library ieee;\nuse ieee.std_logic_1164.all;\nuse ieee.numeric_std.all;\nuse work.fluxproof_pkg.all;\n"
    text = context.rsplit("use", 1)[0] + "package fluxproof_pkg is\n" + "\n".join(shared) + "\nend fluxproof_pkg;\n"
    for name in top.instances.values():
        entity = re.search(r"^entity (\w+) is.*?^end entity", (RTL / name).read_text(), re.MULTILINE | re.DOTALL)
        text += f"{context}{entity[0]};\narchitecture none of {entity[1]} is begin end none;\n"
    (tmp_path / "around.vhd").write_text(text)
    for path in ("around.vhd", str(top.path)):
        done = subprocess.run(["ghdl", "-a", "--std=93", path], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


# ---------------------------------------------------------------- IP-XACT


def test_component_validates_and_a_damaged_one_does_not(component):
    valid = package_command.schema()
    assert valid.validate(component), valid.error_log
    for path in (
        "s:model/s:ports/s:port/s:wire/s:direction",
        "s:memoryMaps/s:memoryMap/s:addressBlock/s:range",
    ):
        damaged = etree.fromstring(etree.tostring(component))
        element = damaged.find(path, S)
        element.getparent().remove(element)
        assert not valid.validate(damaged), f"{path} may be missing"


def test_component_matches_the_vhdl(component):
    entity = read_entity(axi_top.PATH)
    ports = component.findall("s:model/s:ports/s:port", S)
    assert names(ports) == list(entity.pins)
    for port in ports:
        pin = entity.pins[port.findtext("s:name", namespaces=S)]
        assert port.findtext("s:wire/s:direction", namespaces=S) == pin.mode
        left = port.find("s:wire/s:vector/s:left", S)
        assert (left is None) == (pin.left is None), pin.name
        if left is not None:
            generics = {n: g.default for n, g in entity.generics.items()}
            assert int(left.text) == eval(pin.left, {}, generics), pin.name
    parameters = {
        e.findtext("s:name", namespaces=S): e.find("s:value", S)
        for e in component.findall("s:parameters/s:parameter", S)
    }
    assert set(parameters) == set(entity.generics) | {"Component_Name"}
    for name, generic in entity.generics.items():
        limits = [int(parameters[name].get(f"{{{ipxact.SPIRIT}}}{end}")) for end in ("minimum", "maximum")]
        assert (int(parameters[name].text), *limits) == (generic.default, generic.low, generic.high)


def test_interfaces_contain_each_bus_pin_once(component):
    taken = [e.text for e in component.iterfind("s:busInterfaces/s:busInterface/s:portMaps//s:physicalPort/s:name", S)]
    assert len(taken) == len(set(taken))
    buses = {p for p in read_entity(axi_top.PATH).pins if re.match("s_axi_|m_axis_", p)}
    assert buses | {"aclk", "aresetn", "irq"} == set(taken)


def test_memory_map_is_the_registers(component):
    block = component.find("s:memoryMaps/s:memoryMap/s:addressBlock", S)
    assert int(block.findtext("s:range", namespaces=S)) == 4096
    got = {
        r.findtext("s:name", namespaces=S): int(r.findtext("s:addressOffset", namespaces=S), 0)
        for r in block.findall("s:register", S)
    }
    assert got == {w.name: w.address for w in vhdl.of_core(words(compile_file(RTL / ipxact.RDL)))}


def test_files_of_the_component_exist_in_compile_order(component):
    entries = component.findall("s:fileSets/s:fileSet", S)
    assert all((ROOT / name).exists() for fileset in entries for name in names(fileset.findall("s:file", S)))
    for fileset in entries[:2]:
        vhdl = [name for name in names(fileset.findall("s:file", S)) if name.endswith(".vhd")]
        assert vhdl == axi_top.source_names()
        assert set(vhdl) == {p.relative_to(ROOT).as_posix() for p in rtl_sources()}


def test_clock_rate_follows_the_clock(component):
    """The block design's script is named where Vivado looks for it, and sets a parameter that exists."""
    view = {v.findtext("s:name", namespaces=S): v for v in component.findall("s:model/s:views/s:view", S)}
    view = view["xilinx_blockdiagram"]
    assert view.findtext("s:envIdentifier", namespaces=S) == ":vivado.xilinx.com:block.diagram"
    fileset = view.findtext("s:fileSetRef/s:localName", namespaces=S)
    files = {f.findtext("s:name", namespaces=S): f for f in component.findall("s:fileSets/s:fileSet", S)}
    assert names(files[fileset].findall("s:file", S)) == [ipxact.BLOCK_DESIGN]
    script = (ROOT / ipxact.BLOCK_DESIGN).read_text()
    assert set(re.findall(r"CONFIG\.(\w+)", script)) == {"FREQ_HZ", "CLOCK_HZ"} and "CLOCK_HZ" in axi_top.GENERICS
    assert "$cell_name/aclk" in script and "aclk" in ipxact.INTERFACES


def test_zip_is_an_ip_repository(component, tmp_path, monkeypatch, capsys):
    """All files that component.xml names are inside; a stale or invalid component is not packed."""
    assert package_command.problems() == []
    path = package_command.pack(tmp_path / "core.zip")
    first = path.read_bytes()
    with zipfile.ZipFile(path) as archive:
        inside = set(archive.namelist())
    named = {e.text for e in component.iterfind("s:fileSets/s:fileSet/s:file/s:name", S)}
    assert named | {"component.xml", "LICENSE", "docs/software/bring_up.c"} <= inside
    assert package_command.pack(path).read_bytes() == first
    damaged = tmp_path / "component.xml"
    damaged.write_text(ipxact.PATH.read_text().replace("<spirit:direction>in<", "<spirit:direction>into<", 1))
    monkeypatch.setattr(ipxact, "PATH", damaged)
    monkeypatch.setattr(packaged, "files", lambda: {})
    monkeypatch.setattr("sys.argv", ["package"])
    assert package_command.main() == 1
    assert re.search(r"package: component.xml:\d+: .*'into'", capsys.readouterr().err)
