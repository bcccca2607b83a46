# SPDX-License-Identifier: BSD-3-Clause
"""Writes component.xml, the IP-XACT description (IEEE 1685-2009) of fluxproof_axi for Vivado.

Ports and generics come from the VHDL entity, the memory map from the registers' SystemRDL, the files from
fluxproof/cosim/sources.py.  Tool-specific parts (views, families, the type of a VHDL-2008 file) are written as
Vivado writes them.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from lxml import etree
from lxml.builder import ElementMaker
from peakrdl_ipxact import IPXACTExporter
from peakrdl_ipxact.exporter import Standard
from systemrdl import RDLCompiler

from fluxproof.checkout import ROOT, RTL
from fluxproof.cosim.entity import Entity, Generic, Pin, parse_entity
from golden_model.io import board_map
from scripts.package.axi_top import PATH as TOP_PATH
from scripts.package.axi_top import source_names

SPIRIT = "http://www.spiritconsortium.org/XMLSchema/SPIRIT/1685-2009"
XILINX = "http://www.xilinx.com"
XSI = "http://www.w3.org/2001/XMLSchema-instance"

PATH = ROOT / "component.xml"
RDL = "generated/fluxproof.rdl"  # below rtl/
CONSTRAINTS = "scripts/vivado/fluxproof.xdc"
CLOCK_SCRIPT = "scripts/vivado/clock.tcl"  # for the core alone: Vivado makes a constraint of its own for an IP
BLOCK_DESIGN = "bd/bd.tcl"  # lets CLOCK_HZ follow the clock that is connected; Vivado wants this name
XGUI = "xgui/fluxproof_axi.tcl"
VENDOR, LIBRARY = "fluxproof", "motor_control"
TITLE = "Fluxproof PMSM drive"
SUMMARY = "Field-oriented control of a permanent-magnet synchronous motor, from ADC codes to gates, with flux estimator"
ADDRESS_BITS = 12
# All families of Vivado with 25x18 multipliers; the core is specific to none.
FAMILIES = (
    "artix7 artix7l aartix7 kintex7 kintex7l virtex7 spartan7 aspartan7 zynq azynq "
    "kintexu virtexu kintexuplus virtexuplus artixuplus zynquplus"
).split()
SYNTHESIS, SIMULATION = "xilinx_anylanguagesynthesis", "xilinx_anylanguagebehavioralsimulation"

# interface -> (bus, library, mode, {logical port: pin}, parameters)
_LITE = "AWADDR AWPROT AWVALID AWREADY WDATA WSTRB WVALID WREADY BRESP BVALID BREADY ARADDR ARPROT ARVALID ARREADY"
_LITE += " RDATA RRESP RVALID RREADY"
INTERFACES = {
    "s_axi": ("aximm", "interface", "slave", {n: f"s_axi_{n.lower()}" for n in _LITE.split()}, {}),
    "m_axis": (
        "axis",
        "interface",
        "master",
        {n: f"m_axis_{n.lower()}" for n in ("TDATA", "TVALID", "TREADY", "TLAST")},
        {},
    ),
    "aclk": (
        "clock",
        "signal",
        "slave",
        {"CLK": "aclk"},
        {"ASSOCIATED_BUSIF": "s_axi:m_axis", "ASSOCIATED_RESET": "aresetn"},
    ),
    "aresetn": ("reset", "signal", "slave", {"RST": "aresetn"}, {"POLARITY": "ACTIVE_LOW"}),
    "irq": ("interrupt", "signal", "master", {"INTERRUPT": "irq"}, {"SENSITIVITY": "LEVEL_HIGH"}),
}

E = ElementMaker(namespace=SPIRIT, nsmap={"spirit": SPIRIT, "xilinx": XILINX, "xsi": XSI})
X = ElementMaker(namespace=XILINX, nsmap={"xilinx": XILINX})


def project_version() -> str:
    """The project's version, three numbers."""
    found = re.search(r'^version = "(\d+\.\d+\.\d+)"', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    if found is None:
        raise ValueError('pyproject.toml: no line version = "1.2.3"')
    return found.group(1)


def version() -> str:
    """Major and minor number; Vivado accepts no third."""
    return project_version().rsplit(".", 1)[0]


def spirit(**attributes: str | int) -> dict[str, str]:
    """Attributes in spirit's namespace."""
    return {f"{{{SPIRIT}}}{name}": str(value) for name, value in attributes.items()}


def component(entity: Entity, rtl: Path = RTL) -> etree._Element:
    """The whole component; ``rtl``: folder of its sources and register description."""
    return E.component(
        E.vendor(VENDOR),
        E.library(LIBRARY),
        E.name(entity.name),
        E.version(version()),
        E.busInterfaces(*(_interface(name, entity) for name in INTERFACES)),
        memory_maps(rtl / RDL),
        E.model(
            E.views(
                _view(SYNTHESIS, "Synthesis", "synthesis", entity.name),
                _view(SIMULATION, "Simulation", "simulation", entity.name),
                _view("xilinx_xpgui", "UI Layout", "xgui.ui", None),
                _view("xilinx_blockdiagram", "Block Diagram", "block.diagram", None),
            ),
            E.ports(*(_port(pin, entity) for pin in entity.pins.values())),
            E.modelParameters(*(_model_parameter(g) for g in entity.generics.values())),
        ),
        E.fileSets(
            _file_set(SYNTHESIS, [*_vhdl_files(rtl), _constraints_file()]),
            _file_set(SIMULATION, _vhdl_files(rtl)),
            _file_set("xilinx_xpgui", [_file(XGUI, "tclSource", "XGUI_VERSION_2")]),
            _file_set("xilinx_blockdiagram", [_file(BLOCK_DESIGN, "tclSource")]),
        ),
        E.description(SUMMARY),
        E.parameters(*(_parameter(g) for g in entity.generics.values()), _component_name(entity)),
        _vendor_extensions(),
    )


def render(top: str, rtl: Path = RTL) -> str:
    """component.xml as text; ``top`` is the text of fluxproof_axi.vhd."""
    root = component(parse_entity(top, TOP_PATH.name), rtl)
    etree.indent(root)
    etree.cleanup_namespaces(root, top_nsmap={"spirit": SPIRIT, "xilinx": XILINX, "xsi": XSI})
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True).decode()


def memory_maps(rdl: Path) -> etree._Element:
    """The registers as peakrdl describes them, under the name that s_axi refers to."""
    compiler = RDLCompiler()
    compiler.compile_file(str(rdl))
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "map.xml"
        exporter = IPXACTExporter(vendor=VENDOR, library=LIBRARY, standard=Standard.IEEE_1685_2009)
        exporter.export(compiler.elaborate(), str(path))
        maps = etree.parse(path, etree.XMLParser(remove_blank_text=True)).getroot().find(f"{{{SPIRIT}}}memoryMaps")
    (found,) = maps
    found.find(f"{{{SPIRIT}}}name").text = "s_axi"
    (block,) = found.findall(f"{{{SPIRIT}}}addressBlock")
    block.find(f"{{{SPIRIT}}}range").text = str(1 << ADDRESS_BITS)  # the whole address range
    for register in block.findall(f"{{{SPIRIT}}}register"):  # the component has the core's alone
        if int(register.findtext(f"{{{SPIRIT}}}addressOffset"), 0) >= board_map.BASE:
            block.remove(register)
    return maps


def _interface(name: str, entity: Entity) -> etree._Element:
    bus, library, mode, ports, parameters = INTERFACES[name]
    missing = [pin for pin in ports.values() if pin not in entity.pins]
    if missing:
        raise ValueError(f"{entity.name} lacks {', '.join(missing)} of interface {name}")
    kind = {"vendor": "xilinx.com", "library": library, "version": "1.0"}
    reference = [E.memoryMapRef(spirit(memoryMapRef="s_axi"))] if name == "s_axi" else []
    parts = [
        E.name(name),
        E.busType(spirit(**kind, name=bus)),
        E.abstractionType(spirit(**kind, name=f"{bus}_rtl")),
        E(mode, *reference),
        E.portMaps(*(_port_map(logical, pin) for logical, pin in ports.items())),
    ]
    if parameters:
        values = (
            E.parameter(E.name(key), E.value(value, spirit(id=f"BUSIFPARAM_VALUE.{name.upper()}.{key}")))
            for key, value in parameters.items()
        )
        parts.append(E.parameters(*values))
    return E.busInterface(*parts)


def _port_map(logical: str, pin: str) -> etree._Element:
    return E.portMap(E.logicalPort(E.name(logical)), E.physicalPort(E.name(pin)))


def _view(name: str, title: str, environment: str, model: str | None) -> etree._Element:
    language = [] if model is None else [E.language("VHDL"), E.modelName(model)]
    return E.view(
        E.name(name),
        E.displayName(title),
        E.envIdentifier(f":vivado.xilinx.com:{environment}"),
        *language,
        E.fileSetRef(E.localName(f"{name}_view_fileset")),
    )


def _port(pin: Pin, entity: Entity) -> etree._Element:
    wire = [E.direction(pin.mode)]
    if pin.left is not None:
        wire.append(E.vector(_left(pin, entity), E.right("0", spirit(format="long"))))
    views = (E.viewNameRef(SYNTHESIS), E.viewNameRef(SIMULATION))
    wire.append(E.wireTypeDefs(E.wireTypeDef(E.typeName(pin.kind), *views)))
    if pin.name == "trip":  # optional, not every power stage has it
        wire.append(E.driver(E.defaultValue("0", spirit(format="long"))))
    described = [E.description(pin.doc)] if pin.doc else []
    return E.port(E.name(pin.name), *described, E.wire(*wire))


def _left(pin: Pin, entity: Entity) -> etree._Element:
    """The left bound: a number, or generic - 1 as an expression."""
    if pin.left.isdigit():
        return E.left(pin.left, spirit(format="long"))
    name = pin.left.removesuffix(" - 1")
    if name not in entity.generics:
        raise ValueError(f"{entity.name}: {pin.name} is {pin.vhdl_type}, which needs more than a generic less one")
    depends = f"(spirit:decode(id('MODELPARAM_VALUE.{name}')) - 1)"
    value = str(entity.generics[name].default - 1)
    return E.left(value, spirit(format="long", resolve="dependent", dependency=depends))


def _model_parameter(generic: Generic) -> etree._Element:
    kind = {f"{{{XSI}}}type": "spirit:nameValueTypeType"} | spirit(dataType="integer")
    value = spirit(format="long", resolve="generated", id=f"MODELPARAM_VALUE.{generic.name}", rangeType="long")
    return E.modelParameter(E.name(generic.name), E.value(str(generic.default), value), kind)


def _parameter(generic: Generic) -> etree._Element:
    limits = {} if generic.low is None else {"minimum": generic.low, "maximum": generic.high}
    value = spirit(format="long", resolve="user", id=f"PARAM_VALUE.{generic.name}", **limits, rangeType="long")
    title = generic.doc[:1].upper() + generic.doc[1:]
    return E.parameter(E.name(generic.name), E.displayName(title), E.value(str(generic.default), value))


def _component_name(entity: Entity) -> etree._Element:
    value = spirit(resolve="user", id="PARAM_VALUE.Component_Name", order=1)
    return E.parameter(E.name("Component_Name"), E.value(f"{entity.name}_0", value))


def _file_set(view: str, files: list[etree._Element]) -> etree._Element:
    return E.fileSet(E.name(f"{view}_view_fileset"), *files)


def _file(name: str, kind: str | None, *user_kinds: str) -> etree._Element:
    kinds = [] if kind is None else [E.fileType(kind)]
    return E.file(E.name(name), *kinds, *(E.userFileType(k) for k in user_kinds))


def _vhdl_files(rtl: Path) -> list[etree._Element]:
    """Files in compile order; all VHDL-2008 except the top, so that a block design accepts it as a module."""
    names = source_names(rtl)
    return [_file(n, "vhdlSource") if n.endswith(TOP_PATH.name) else _file(n, None, "vhdlSource-2008") for n in names]


def _constraints_file() -> etree._Element:
    """Used in implementation only: it names registers, which exist after synthesis."""
    return _file(CONSTRAINTS, None, "xdc", "USED_IN_implementation")


def _vendor_extensions() -> etree._Element:
    families = (X.family(name, {f"{{{XILINX}}}lifeCycle": "Production"}) for name in FAMILIES)
    return E.vendorExtensions(
        X.coreExtensions(
            X.supportedFamilies(*families),
            X.taxonomies(X.taxonomy("/UserIP")),
            X.displayName(TITLE),
            X.coreRevision("1"),
        )
    )
