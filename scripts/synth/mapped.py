"""The mapped netlist as something that runs: what yosys made of the core for Xilinx, cell by cell, in Verilator.

A count is worth nothing where the mapping is wrong, and yosys has packed adders into a DSP48 wrongly before (a
difference into the pre-adder without its signs; a sum with its own feedback).  The netlist is put together again from
yosys' own models of the cells.  Block RAM has no such model: tables are LUTs here, everything else is as counted.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path

from fluxproof.checkout import RTL
from fluxproof.cosim.verilated import CACHE, VerilatedCore, compiled
from fluxproof.cosim.verilog import TOP, conversion_key, convert
from scripts.synth.ecp5 import mapping, reshape
from scripts.synth.netlist import BITS
from scripts.synth.yosys import SYNTH, version, yosys

# What yosys has no model of.  Ports and parameters are those that the mapping and our passes use.
MULTIPLIER = """
module MULT18X18D(input {inputs}, output {outputs});
  parameter REG_INPUTA_CLK = "NONE", REG_INPUTA_CE = "CE0", REG_INPUTA_RST = "RST0";
  parameter REG_INPUTB_CLK = "NONE", REG_INPUTB_CE = "CE0", REG_INPUTB_RST = "RST0";
  parameter REG_OUTPUT_CLK = "NONE", REG_OUTPUT_CE = "CE0", REG_OUTPUT_RST = "RST0";
  parameter RESETMODE = "SYNC";
  wire [17:0] a = {{{a}}}, b = {{{b}}};
  reg [17:0] a_held = 0, b_held = 0;
  reg [35:0] p_held = 0;
  generate
    if (REG_INPUTA_CLK != "NONE")
      always @(posedge CLK0) if (REG_INPUTA_CE == "CE0" ? CE0 : CE1) a_held <= a;
    if (REG_INPUTB_CLK != "NONE")
      always @(posedge CLK0) if (REG_INPUTB_CE == "CE0" ? CE0 : CE1) b_held <= b;
    if (REG_OUTPUT_CLK != "NONE")
      always @(posedge CLK0) if (REG_OUTPUT_CE == "CE0" ? CE0 : CE2) p_held <= p;
  endgenerate
  wire [17:0] a_used = REG_INPUTA_CLK == "NONE" ? a : a_held, b_used = REG_INPUTB_CLK == "NONE" ? b : b_held;
  wire signed [18:0] a_whole = {{SIGNEDA & a_used[17], a_used}}, b_whole = {{SIGNEDB & b_used[17], b_used}};
  wire [35:0] p = a_whole * b_whole;
  assign {{{outputs}}} = REG_OUTPUT_CLK == "NONE" ? p : p_held;
endmodule
"""


def multiplier_model() -> str:
    """MULT18X18D in Verilog: operands and product with a register each where a parameter says so."""
    pins = {side: [f"{side}{n}" for n in reversed(range(width))] for side, width in BITS.items()}
    control = [f"{pin}{n}" for pin in ("CLK", "CE", "RST") for n in range(4)]
    inputs = [
        *pins["A"],
        *pins["B"],
        *(f"C{n}" for n in range(18)),
        "SIGNEDA",
        "SIGNEDB",
        "SOURCEA",
        "SOURCEB",
        *control,
    ]
    sides = {name: ", ".join(pins[name.upper()]) for name in "ab"}
    return MULTIPLIER.format(inputs=", ".join(inputs), outputs=", ".join(pins["P"]), **sides)


def models(read: list[str], top: str) -> list[str]:
    """yosys' commands that turn what ``read`` reads into mapped.v without cells."""
    # `flatten` puts the models in the cells' places; `proc` makes logic of what is written as a process in them.
    return [*read, f"hierarchy -top {top}", "proc", "flatten", "opt_clean", "write_verilog -noattr mapped.v"]


def map_xc7(work: Path, top: str) -> None:
    """Puts the netlist that is counted into ``work``/mapped.v."""
    synth = SYNTH.format(family="xc7", top=top) + " -nobram"
    yosys([f"read_verilog {top}.v", synth, "write_verilog -noattr netlist.v"], work)
    yosys(models(["read_verilog netlist.v", "read_verilog +/xilinx/cells_sim.v"], top), work)


def map_ecp5(work: Path, top: str) -> None:
    """Puts the netlist that is placed into ``work``/mapped.v: as mapped, then as our passes leave it."""
    yosys([f"read_verilog {top}.v", *mapping(top, "-nobram")], work)
    netlist = {"modules": {top: json.loads((work / "design.json").read_text())["modules"][top]}}
    reshape(netlist, top)
    (work / "netlist.json").write_text(json.dumps(netlist))
    (work / "multiplier.v").write_text(multiplier_model())
    cells = ["read_verilog -nooverwrite +/lattice/cells_sim_ecp5.v", "read_verilog multiplier.v"]
    yosys(models(["read_json netlist.json", *cells], top), work)


def build(generics: Mapping[str, int], family: str, rtl: Path = RTL, top: str = TOP) -> Path:
    """The folder with the compiled netlist and ``top``.v, made if it is not there yet."""
    source = convert(generics, CACHE.parent / "verilog" / conversion_key(generics, rtl, top), rtl, top)
    map_it = {"xc7": map_xc7, "ecp5": map_ecp5}[family]
    ours = [path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py"))]

    def change(work: Path) -> None:
        map_it(work, top)
        os.replace(work / "mapped.v", work / f"{top}.v")

    return compiled(source.read_bytes(), rtl, top, (family, ours, version()), change)


class MappedCore(VerilatedCore):
    """A VerilatedCore whose inside is the netlist for ``family``."""

    def __init__(self, generics: Mapping[str, int], family: str = "xc7", rtl: Path = RTL, top: str = TOP):
        super().__init__(generics, rtl, top, folder=build(generics, family, rtl, top))
