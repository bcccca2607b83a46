# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof project`: every file follows the drive file, the clock most of all; the scripts run in the stub."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace

import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.vivado.tclsh import stubbed
from fluxproof.checkout import DRIVES, ROOT
from fluxproof.command import main
from fluxproof.cosim.entity import read_entity
from fluxproof.hil.registers import motor_scale
from fluxproof.plant import Machine
from fluxproof.project import need
from golden_model.drive import load
from golden_model.registers import registers
from scripts.package import axi_top, hil_top

ZYNQ, ARTIX, ULTRASCALE = "xc7z020clg484-1", "xc7a100tcsg324-1", "xczu3eg-sbva484-1-e"


def made(tmp_path, name="drive", part=ZYNQ, *options, **changes):
    """(folder, {file: text}, drive) of the paper's drive with changed values."""
    text = PAPER.read_text()
    for key, value in changes.items():
        text = re.sub(rf"^{key} = \S+", f"{key} = {value}", text, flags=re.MULTILINE)
    path = tmp_path / f"{name}.toml"
    path.write_text(text)
    folder = tmp_path / name
    assert main(["project", str(path), "--part", part, "--out", str(folder), *options]) == 0
    return folder, {p.name: p.read_text() for p in folder.iterdir()}, load(path)


def clock_values(files: dict[str, str]) -> dict[str, float]:
    """Every value that depends on the clock, read back from the files."""
    header, found = files["drive_registers.h"], {}
    for name in ("dead_time", "min_pulse", "watchdog"):
        found[name] = int(re.search(rf"(-?\d+)\}}, /\* {name}:", header)[1])
    found["header CLOCK_HZ"] = int(re.search(r"FLUXPROOF_CLOCK_HZ (\d+)", header)[1])
    found["header CARRIER_HALF"] = int(re.search(r"FLUXPROOF_CARRIER_HALF (\d+)", header)[1])
    for name in ("CLOCK_HZ", "CARRIER_HALF"):
        found[f"VHDL {name}"] = int(re.search(rf"{name} +: natural := (\d+);", files["drive_pkg.vhd"])[1])
        found[f"Tcl {name}"] = int(re.search(rf"set {name.lower()} (\d+)", files["project.tcl"])[1])
    found["period"] = float(re.search(r"-period (\S+)", files["fluxproof_clock.xdc"])[1])
    found["device tree"] = int(re.search(r"assigned-clock-rates = <(\d+)>", files["fluxproof.dtsi"])[1])
    return found


def test_every_value_follows_the_clock(tmp_path):
    """Twice 200 MHz against 100 MHz: counts of clocks halve, the period doubles, rates halve; nothing stays."""
    fast, slow = (
        clock_values(made(tmp_path, name, clock_hz=clock)[1]) for name, clock in (("fast", "200e6"), ("slow", "100e6"))
    )
    assert fast["period"] == 5.0 and fast["device tree"] == 200_000_000
    for name, value in fast.items():
        assert slow[name] == (2 * value if name == "period" else value / 2), name


def test_nothing_else_depends_on_the_clock(tmp_path):
    """Lines that differ between two clocks are those whose values are read back above."""
    _, fast, _ = made(tmp_path, "fast", clock_hz="200e6")
    _, slow, _ = made(tmp_path, "slow", clock_hz="100e6")
    differing = []
    for name in fast:
        texts = (fast[name].replace("fast.toml", ""), slow[name].replace("slow.toml", ""))
        pairs = zip(*(text.splitlines() for text in texts), strict=True)
        differing += [(name, a) for a, b in pairs if a != b]
    assert len(differing) == len(clock_values(fast)) + 1, differing  # the comment of the constraint


def test_generics_are_those_of_the_top(tmp_path):
    folder, files, drive = made(tmp_path, adc_bits="12", position_bits="14")
    config = registers(drive).config._asdict() | {"clock_hz": 200_000_000}
    config |= {"ring_rows": 0, "gate_active": 1, "trip_active": 1, "brake_active": 1, "trip_filter": 0}
    for name in axi_top.GENERICS:
        assert f"set {name.lower()} {config[name.lower()]}\n" in files["project.tcl"]
        assert re.search(rf"{name} +: natural := {config[name.lower()]};", files["drive_pkg.vhd"])
    done = subprocess.run(["ghdl", "-a", "--std=93", folder / "drive_pkg.vhd"], cwd=tmp_path, capture_output=True)
    assert done.returncode == 0, done.stderr


def test_header_compiles_into_bring_up(tmp_path):
    compiler = shutil.which("cc") or pytest.skip("there is no C compiler here")
    folder, _, _ = made(tmp_path)
    software = ROOT / "docs" / "software"
    sources = [software / "bring_up.c", software / "bus_uio.c"]
    command = [compiler, "-Wall", "-Wextra", "-Werror", "-I", software, "-I", folder, *sources, "-lm", "-o"]
    done = subprocess.run([*command, tmp_path / "bring_up"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_script_builds_the_system_of_a_zynq(facts, tmp_path):  # noqa: F811
    folder, _, _ = made(tmp_path, "drive", ZYNQ, "--base", "0x43C10000", clock_hz="100e6", adc_bits="12")
    done = stubbed(facts, folder / "project.tcl")
    assert done.returncode == 0, done.stderr
    for text in ("CONFIG.ADC_BITS 12", "CONFIG.CARRIER_HALF 5000", "-offset 0x43C10000", f"-part {ZYNQ}"):
        assert text in done.stdout
    assert "CONFIG.PCW_FPGA0_PERIPHERAL_FREQMHZ 100 " in done.stdout
    assert re.search(r"^set_property  CONFIG.CLOCK_HZ 100000000 drive$", done.stdout, re.MULTILINE)
    assert json.loads((folder / "vivado" / "result.json").read_text())["clock_mhz"] == 100


@pytest.mark.parametrize("part", [ARTIX, ULTRASCALE])
def test_script_builds_the_core_alone(facts, tmp_path, part):  # noqa: F811
    folder, files, _ = made(tmp_path, "drive", part, clock_hz="100e6")
    done = stubbed(facts, folder / "project.tcl")
    assert done.returncode == 0, done.stderr
    assert f"-part {part}" in done.stdout and "CLOCK_HZ=100000000" in done.stdout
    assert re.search(r"^create_clock .*-period 10\.000", done.stdout, re.MULTILINE)
    assert ("fluxproof.dtsi" in files) == (part == ULTRASCALE)


def test_motor_in_the_fpga_needs_no_pins(facts, tmp_path):  # noqa: F811
    """The block design has the top with the motor, nothing leaves the chip; load_motor.c compiles with its words."""
    folder, files, drive = made(tmp_path, "drive", ZYNQ, "--hil", clock_hz="100e6")
    done = stubbed(facts, folder / "project.tcl")
    assert done.returncode == 0, done.stderr
    assert re.search(r"^create_bd_cell .*-reference fluxproof_hil.* drive$", done.stdout, re.MULTILINE)
    assert "CONFIG.ENCODER 0" in done.stdout and "make_bd_pins_external" not in done.stdout
    for name in read_entity(hil_top.HIL.path).generics:
        assert re.search(rf"^  constant {name} +: natural := \d+;", files["drive_pkg.vhd"], re.MULTILINE), name
    assert f"{{0x83C, {round(drive.machine.magnet_flux_wb / flux_base(drive) * 2**23)}}}" in files["motor_registers.h"]
    folder, _, _ = made(tmp_path, "artix", ARTIX, "--hil")
    done = stubbed(facts, folder / "project.tcl")
    assert done.returncode == 0 and "-top fluxproof_hil" in done.stdout, done.stderr
    compiler = shutil.which("cc") or pytest.skip("there is no C compiler here")
    software = ROOT / "docs" / "software"
    command = [compiler, "-Wall", "-Wextra", "-Werror", "-I", software, "-I", folder, software / "load_motor.c"]
    done = subprocess.run([*command, software / "bus_uio.c", "-o", tmp_path / "load"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_motor_that_cannot_be_in_the_fpga_is_told(tmp_path, capsys):
    path = tmp_path / "drive.toml"
    path.write_text(PAPER.read_text() + '\n[encoder]\nkind = "biss"\nbits = 18\nclock_hz = 5e6\npause_s = 12e-6\n')
    assert main(["project", str(path), "--hil", "--part", ZYNQ, "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and not (tmp_path / "out").exists()
    assert f'{path}: [encoder] kind = "biss": the motor in the FPGA has code, abz, hall' in err


def flux_base(drive) -> float:
    machine = Machine.from_mapping(vars(drive.machine))
    return motor_scale(machine, drive.inverter.dc_bus_v, drive.sensors.current_range_a, drive.core.clock_hz).flux_wb


def test_device_tree_of_both_families(tmp_path):
    _, files, _ = made(tmp_path, "drive", ZYNQ, "--base", "0x43C10000")
    assert "fluxproof@43c10000" in files["fluxproof.dtsi"] and "reg = <0x43c10000 0x1000>" in files["fluxproof.dtsi"]
    _, files, _ = made(tmp_path, "wide", ULTRASCALE)
    assert "reg = <0x0 0xa0000000 0x0 0x1000>" in files["fluxproof.dtsi"] and "<&gic>" in files["fluxproof.dtsi"]


@pytest.mark.parametrize(
    ("options", "change", "words"),
    [
        (["--part", "zynq"], {}, ["--part 'zynq'", "xc7z020clg484-1"]),
        (["--part", ZYNQ, "--base", "0x43C00010"], {}, ["--base", "multiple of 0x1000"]),
        (["--part", ZYNQ, "--base", "here"], {}, ["--base 'here'"]),
        (["--part", ZYNQ], {"clock_hz": "300e6"}, ["clock_hz = 3e+08", "2.5e+08 Hz", "Zynq-7000"]),
        (["--part", ZYNQ], {"clock_hz": "1"}, ["a PWM period has 0.0001 clocks"]),
    ],
)  # fmt: skip
def test_mistakes_write_nothing(tmp_path, capsys, options, change, words):
    text = PAPER.read_text()
    for key, value in change.items():
        text = re.sub(rf"^{key} = \S+", f"{key} = {value}", text, flags=re.MULTILINE)
    path = tmp_path / "drive.toml"
    path.write_text(text)
    assert main(["project", str(path), "--out", str(tmp_path / "out"), *options]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and not (tmp_path / "out").exists()
    for word in words:
        assert word in err


def test_a_part_that_is_too_small_is_told(tmp_path, capsys):
    """82 of 80 DSP48: the files are written, and the key that makes it fit is named."""
    drive = DRIVES / "spindle_400v.toml"
    whole, plain = (need.need(load(drive), estimators) for estimators in (True, False))
    assert whole.dsp > need.DEVICES["xc7z010"].dsp >= plain.dsp
    larger = load(drive)
    larger = replace(
        larger, core=replace(larger.core, position_loop=True, residual=True, references=True, ring_rows=42)
    )
    assert need.need(larger, False).dsp == plain.dsp + 9
    for part, words in (
        ("xc7z010clg400-1", f"needs about {whole}, xc7z010 has 80 DSP48 and 17,600 LUT: it does not fit"),
        ("xc7s15cpga196-1", "xc7s50 is large enough"),
    ):
        assert main(["project", str(drive), "--part", part, "--out", str(tmp_path / part)]) == 0
        err = capsys.readouterr().err
        assert err.count("\n") == 1 and words in err
        assert (f"[core] estimators = false needs {plain}" in err) == (part == "xc7z010clg400-1")
    assert main(["project", str(drive), "--part", ZYNQ, "--out", str(tmp_path / "fits")]) == 0
    out, err = capsys.readouterr()
    assert err == "" and "xc7z020 has 220 DSP48" in out


def test_cells_are_those_that_were_counted():
    counts = json.loads((ROOT / "docs" / "synth" / "counts.json").read_text())["counts"]
    for cells, row in (
        (need.WHOLE, counts["xc7"]["total"]),
        (need.PLAIN, counts["xc7, ESTIMATORS = 0"]["total"]),
        (need.REGISTERS, counts["xc7"]["registers_telemetry"]),
    ):
        assert cells == (row["lut"], row["dsp"])
    told = {  # page, its sentences on the blocks of a key
        "position_loop": ("position", r"`position_\w+` ([\d,]+) LUT,.*?(\d) DSP48"),
        "gearing": ("gearing", r"^`gear` (\d+) LUT, \d+ FF, (\d) DSP48"),
        "references": ("speed_range", r"`\w+` (\d+) LUT, (\d) DSP48"),
        "residual": ("faults", r"The block takes ([\d,]+) LUT, .* (one) DSP48"),
        "modes": ("modes", r"`mode_\w+` (\d+) (LUT)"),
        "overmodulation": ("overmodulation", r"`(?:overmodulation|\w*ripple\w*)` (\d+) LUT, \d+ FF, (\d) DSP48"),
        "ring_rows": ("telemetry", r"of 42 rows \| (\d+), \d+, (\d) "),
    }
    for key, (page, sentence) in told.items():
        found = re.findall(sentence, (ROOT / "docs" / f"{page}.md").read_text(), re.MULTILINE)
        lut = sum(int(n.replace(",", "")) for n, _ in found)
        dsp = 0 if key in ("ring_rows", "modes") else sum(1 if n == "one" else int(n) for _, n in found)
        assert found and need.OPTIONS[key] == (lut, dsp), key
    page = (ROOT / "docs" / "board.md").read_text()
    found = re.findall(r"^\| `(\w+_front)`, (.*?) \|(.*)\|$", page, re.MULTILINE)
    rows = {f"{front}, {kind}": cells for front, kind, cells in found}
    names = {
        "code": "position_front, external code", "abz": "position_front, A/B/Z", "hall": "position_front, Hall",
        "ssi": "position_front, SSI", "biss": "position_front, BiSS-C", "endat": "position_front, EnDat",
        "codes": "current_front, external codes", "spi": "current_front, SPI, four lines",
        "xadc": "current_front, XADC, 16 bits", "delta_sigma": "current_front, delta-sigma, four modulators",
    }  # fmt: skip
    assert f"| `master_encoder` | {need.MASTER.lut} |" in page and need.MASTER.dsp == 0
    for kind, cells in (need.ENCODERS | need.CONVERTERS).items():
        lut, _, dsp = (int(text.replace(",", "")) for text in rows[names[kind]].split("|"))
        assert cells == (lut, dsp), kind
