# SPDX-License-Identifier: BSD-3-Clause
"""A netlist that yosys mapped for 7 series (its JSON), as multipliers.py and levels.py read it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

CONSTANTS = ("0", "1", "x", "z")
BLOCK = "block"  # attribute that `marks` gives to the cells of a block before yosys renames them
_UNNAMED = re.compile(r"n\d+_[a-z]+$")  # GHDL's name for a signal that has none in the VHDL
_LINE = re.compile(r"design\.v:(\d+)")
_VHDL = re.compile(r"/\* (\S+\.vhd:\d+)")

Bit = int | str
"""A net's number, or a constant: one of CONSTANTS."""


@dataclass(frozen=True)
class Cell:
    """``parameters`` as integers where yosys writes them in binary, else as text."""

    name: str
    kind: str
    parameters: dict[str, int | str] = field(default_factory=dict)
    inputs: dict[str, list[Bit]] = field(default_factory=dict)
    outputs: dict[str, list[Bit]] = field(default_factory=dict)
    block: str = ""
    source: str = ""

    def number(self, parameter: str) -> int:
        """A parameter's value; 0 where it is not set."""
        return int(self.parameters.get(parameter, 0))


@dataclass(frozen=True)
class Netlist:
    """``names``: the names of a net's number, the VHDL's own first."""

    cells: list[Cell]
    names: dict[int, list[str]]

    def drivers(self) -> dict[Bit, Cell]:
        return {bit: cell for cell in self.cells for bits in cell.outputs.values() for bit in bits}


def marks(blocks: Iterable[str]) -> list[str]:
    """yosys' commands that note in each cell to which of ``blocks`` it belongs; right after ``flatten``.

    ``flatten`` names the cells of core.angle "$flatten\\core.\\angle.NAME"; later passes give flip-flops new names.
    """
    return [f'setattr -set {BLOCK} "{name}" c:$flatten?{name.replace(".", ".?")}.*' for name in blocks]


def block_of(name: str, blocks: Iterable[str]) -> str:
    """The longest of ``blocks`` that ``name`` begins with, "" where there is none."""
    name = name.removeprefix("$flatten").replace("\\", "")
    return max((block for block in blocks if name.startswith(f"{block}.")), key=len, default="")


def _value(text: str) -> int | str:
    return int(text, 2) if re.fullmatch("[01]+", text) else text


def _names(module: dict) -> dict[int, list[str]]:
    names: dict[int, list[str]] = {}
    for name, net in module["netnames"].items():
        if not name.startswith("$"):
            for bit in net["bits"]:
                if isinstance(bit, int) and name not in names.setdefault(bit, []):
                    names[bit].append(name)
    for near in names.values():
        near.sort(key=lambda name: (bool(_UNNAMED.search(name)), len(name), name))
    return names


def vhdl_line(verilog: Sequence[str], source: str) -> str:
    """ "FILE.vhd:LINE" for yosys' src attribute: GHDL writes it in a comment above what it converts; else ""."""
    found = _LINE.search(source)
    if found:
        for line in reversed(verilog[: int(found[1])]):
            if vhdl := _VHDL.search(line):
                return vhdl[1]
            if line.startswith("module "):
                break
    return ""


def read(path: Path, top: str, blocks: Sequence[str], verilog: Sequence[str] = ()) -> Netlist:
    """The netlist of ``top`` in yosys' JSON; ``verilog``: the lines of the design.v that was mapped."""
    module = json.loads(path.read_text())["modules"][top]
    names, cells = _names(module), []
    for name, cell in module["cells"].items():
        if cell["type"].startswith("$"):
            continue  # $scopeinfo: no hardware
        sides: dict[str, dict[str, list[Bit]]] = {"input": {}, "output": {}}
        for port, bits in cell["connections"].items():
            sides[cell["port_directions"][port]][port] = bits
        attributes = cell.get("attributes", {})
        own = [n for bits in sides["output"].values() for bit in bits for n in names.get(bit, ())]
        found = (block_of(n, blocks) for n in (name, *own))
        block = attributes.get(BLOCK) or next((b for b in found if b), "")
        parameters = {key: _value(value) for key, value in cell.get("parameters", {}).items()}
        source = vhdl_line(verilog, attributes.get("src", ""))
        cells.append(Cell(name, cell["type"], parameters, sides["input"], sides["output"], block, source))
    return Netlist(cells, names)
