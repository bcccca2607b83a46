# SPDX-License-Identifier: BSD-3-Clause
"""The text of each file of a project, from a drive and its registers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from fluxproof.print_registers import c_lines
from fluxproof.project.parts import ZYNQ, Processor, processor_of
from fluxproof.quote import c_comment, tcl_comment, tcl_word, vhdl_comment
from golden_model.board_registers import board_generics, has_board, pin_generics
from golden_model.drive import Drive
from golden_model.registers import RegisterSet

BY = "by `fluxproof project`; change the drive file and run it again"
NAMES = ("fluxproof_clock.xdc", "drive_pkg.vhd", "project.tcl", "drive_registers.h", "fluxproof.dtsi")
WINDOW = 0x1000  # bytes of the registers' address range


class Project(NamedTuple):
    """What the files are written from; ``hil``: with a motor in the FPGA."""

    path: str
    drive: Drive
    register_set: RegisterSet
    part: str
    base: int
    core: str
    hil: bool

    @property
    def name(self) -> str:
        return Path(self.path).name


def generics(drive: Drive, register_set: RegisterSet, hil: bool = False) -> dict[str, int]:
    """The generics of the top, by their names in the VHDL."""
    chosen = board_generics(drive) if has_board(drive) or hil else {}
    if hil:
        chosen = {**chosen, "temperatures": 1}
    named = register_set.config._asdict() | pin_generics(drive) | chosen
    return {"CLOCK_HZ": round(drive.core.clock_hz), **{name.upper(): value for name, value in named.items()}}


def top(drive: Drive, hil: bool = False) -> str:
    """fluxproof_board where the drive file describes front ends, else fluxproof_axi; fluxproof_hil with a motor."""
    return "fluxproof_hil" if hil else "fluxproof_board" if has_board(drive) else "fluxproof_axi"


def clock_period_ns(drive: Drive) -> float:
    """The clock's period cut to whole picoseconds [ns], as scripts/vivado/clock.tcl has it."""
    return math.floor(1e12 / round(drive.core.clock_hz)) / 1e3


def clock_xdc(name: str, drive: Drive) -> str:
    """The clock constraint of the core alone; in a block design the clock comes from outside."""
    return (
        tcl_comment(f"{name} {BY}: [core] clock_hz = {drive.core.clock_hz:g}.") + "\n"
        "# Only where the core is the top: in a block design the clock comes from outside, with a constraint.\n"
        f"create_clock -name aclk -period {clock_period_ns(drive):.3f} [get_ports aclk]\n"
    )


def vhdl_package(project: Project) -> str:
    """The generics as constants, for an instance by hand."""
    values = generics(project.drive, project.register_set, project.hil)
    wide = max(map(len, values))
    lines = [f"  constant {key:{wide}} : natural := {value};" for key, value in values.items()]
    use = f"-- Generics of {top(project.drive, project.hil)}: generic map (CLOCK_HZ => drive_pkg.CLOCK_HZ, ...)"
    head = [vhdl_comment(f"{project.name} {BY}."), use, ""]
    return "\n".join([*head, "package drive_pkg is", *lines, "end package drive_pkg;"]) + "\n"


def tcl(project: Project) -> str:
    """The script for Vivado: a block design around the core on a Zynq-7000, the core or the board's top alone else.

    A motor in the FPGA needs no pins, so that the front ends of a board do not keep it out of the block design.
    """
    drive, hil = project.drive, project.hil
    values = generics(drive, project.register_set, hil)
    whole = processor_of(project.part) is ZYNQ and (hil or not has_board(drive))
    head = [
        tcl_comment(f"{project.name} {BY}."),
        "#",
        "#   vivado -mode batch -source project.tcl [-tclargs CORE_DIR]",
        "#",
        "# CORE_DIR: the folder of a checkout of Fluxproof.",
        "",
        "set here [file dirname [file normalize [info script]]]",
        f"set core {tcl_word(project.core)}",
        "if {$argc > 0} {",
        "  set core [file normalize [lindex $argv 0]]",
        "}",
        "if {![file exists [file join $core scripts vivado example.tcl]]} {",
        '  error "$core is no checkout of Fluxproof: give its folder with -tclargs"',
        "}",
        f"set part {project.part}",
        f"set hil {int(hil)}",
        *(f"set {key.lower()} {value}" for key, value in values.items()),
    ]
    rest = _system(project.base) if whole else _alone(values, top(drive, hil))
    return "\n".join([*head, *rest]) + "\n"


def _system(base: int) -> list[str]:
    return [
        f"set base_address 0x{base:08X}",
        "# Processor, DMA and core, placed and routed, with reports, in the folder vivado beside this script.",
        "set argc 2",
        "set argv [list [file join $here vivado] $part]",
        "source [file join $core scripts vivado example.tcl]",
    ]


def _alone(values: dict[str, int], name: str) -> list[str]:
    names = " ".join(f"{key}=${key.lower()}" for key in values)
    return [
        f"# {name} alone, out of context: the example's processor system is for fluxproof_axi on a Zynq-7000.",
        "create_project -in_memory -part $part",
        "set sources [concat [glob [file join $core rtl *.vhd]] [glob [file join $core rtl * *.vhd]]]",
        "read_vhdl -vhdl2008 $sources",
        "read_xdc -mode out_of_context [file join $here fluxproof_clock.xdc]",
        f"synth_design -top {name} -part $part -mode out_of_context -generic [list {names}]",
        "read_xdc [file join $core scripts vivado fluxproof.xdc]",
        *(
            f"{command} [file join $core scripts vivado {file}]"
            for command, file in (("read_xdc", "fluxproof_board.xdc"), ("source", "board_pins.tcl"))
            if name == "fluxproof_board"
        ),
        "opt_design",
        "place_design",
        "route_design",
        "file mkdir [file join $here vivado]",
        f"write_checkpoint -force [file join $here vivado {name}.dcp]",
        "report_utilization -hierarchical -file [file join $here vivado utilization.rpt]",
        "report_timing_summary -file [file join $here vivado timing.rpt]",
    ]


def c_header(name: str, drive: Drive, register_set: RegisterSet) -> str:
    """What bring_up.c includes: bases, generics, the registers' values."""
    return "\n".join(c_lines(name, drive, register_set)) + "\n"


def device_tree(name: str, drive: Drive, processor: Processor, base: int) -> str:
    """The core as a UIO device of Linux, with the clock that its fabric clock must run at."""
    wide = "0x0 " if processor.cells == 2 else ""
    head = c_comment(
        f"{name} {BY}.",
        "",
        f"Fragment for a {processor.name}: include it in the board's device tree.  The kernel needs",
        "uio_pdrv_genirq with uio_pdrv_genirq.of_id=generic-uio on its command line.",
    )
    return f"""\
{head}
/ {{
    fluxproof: fluxproof@{base:x} {{
        compatible = "generic-uio";
        reg = <{wide}0x{base:08x} {wide}0x{WINDOW:x}>;
        interrupt-parent = <{processor.controller}>;
        interrupts = <0 {processor.interrupt} 4>; /* irq of the core on the first fabric interrupt, level high */
        clocks = <{processor.clock}>;
        assigned-clocks = <{processor.clock}>;
        assigned-clock-rates = <{round(drive.core.clock_hz)}>;
    }};
}};
"""


def files(project: Project, processor: Processor | None) -> dict[str, str]:
    """{file name: text} of the whole project."""
    name, drive = project.name, project.drive
    texts = [
        clock_xdc(name, drive),
        vhdl_package(project),
        tcl(project),
        c_header(project.path, drive, project.register_set),
        *([device_tree(name, drive, processor, project.base)] if processor is not None else []),
    ]
    return dict(zip(NAMES, texts, strict=False))
