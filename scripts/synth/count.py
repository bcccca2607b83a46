# SPDX-License-Identifier: BSD-3-Clause
"""Counting cells: what yosys prints, as LUT, FF, DSP and block RAM; unknown cells are an error."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path

# LUT sites a cell takes.  INV is a LUT1 to yosys; Vivado mostly absorbs it.
LOGIC = {**{f"LUT{n}": 1 for n in range(1, 7)}, "INV": 1}
MEMORY = {
    **{"SRL16": 1, "SRL16E": 1, "SRLC16E": 1, "SRLC32E": 1, "RAM32M": 4, "RAM64M": 4, "RAM32M16": 8},
    **{"RAM64M8": 8, "RAM16X1D": 2, "RAM32X1D": 2, "RAM64X1D": 2, "RAM128X1D": 4, "RAM256X1D": 8},
    **{"RAM16X1S": 1, "RAM32X1S": 1, "RAM64X1S": 1, "RAM128X1S": 2, "RAM256X1S": 4, "RAM512X1S": 8},
}
FLIP_FLOP = {f"FD{kind}E{edge}" for kind in "RSCP" for edge in ("", "_1")}
DSP = {"DSP48E1", "DSP48E2"}
# block RAM in units of a RAMB36, as Xilinx counts it
BLOCK_RAM = {"RAMB18E1": 0.5, "RAMB18E2": 0.5, "RAMB36E1": 1.0, "RAMB36E2": 1.0}
WIDE_MUX = {"MUXF7", "MUXF8", "MUXF9"}
CARRY = {"CARRY4": 4, "CARRY8": 8}  # in bits
NOTHING = {"$scopeinfo", "BUFG", "BUFGCTRL", "IBUF", "OBUF", "GND", "VCC"}


@dataclass(frozen=True)
class Count:
    """``lut`` includes ``lut_memory`` (shift registers, distributed RAM); ``bram`` in RAMB36 equivalents."""

    lut: int = 0
    ff: int = 0
    dsp: int = 0
    bram: float = 0
    lut_memory: int = 0
    muxf: int = 0
    carry_bits: int = 0
    latches: int = 0

    def __add__(self, other: Count) -> Count:
        return Count(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))

    def kept(self) -> dict[str, float]:
        """The four figures of the report and of the kept file."""
        return {key: value for key, value in asdict(self).items() if key in ("lut", "ff", "dsp", "bram")}


def count(cells: Mapping[str, int]) -> Count:
    """``cells`` = {type: number}; raises ValueError naming a type that is in no list above."""
    total = Counter()
    for kind, number in cells.items():
        if kind in LOGIC:
            total["lut"] += number * LOGIC[kind]
        elif kind in MEMORY:
            total["lut"] += number * MEMORY[kind]
            total["lut_memory"] += number * MEMORY[kind]
        elif kind in FLIP_FLOP:
            total["ff"] += number
        elif kind in ("LDCE", "LDPE"):
            total["latches"] += number
        elif kind in DSP:
            total["dsp"] += number
        elif kind in BLOCK_RAM:
            total["bram"] += number * BLOCK_RAM[kind]
        elif kind in WIDE_MUX:
            total["muxf"] += number
        elif kind in CARRY:
            total["carry_bits"] += number * CARRY[kind]
        elif kind not in NOTHING:
            raise ValueError(f"scripts/synth/count.py knows no cell {kind} ({number} of them); name it there")
    return Count(**total)


def read_cells(stat: Path) -> dict[str, dict[str, int]]:
    """{module: {type: number}} of `stat -json`; instances of other modules of the file are left out."""
    modules = json.loads(stat.read_text())["modules"]
    names = {name.removeprefix("\\"): body.get("num_cells_by_type", {}) for name, body in modules.items()}
    return {
        name: {k.removeprefix("\\"): n for k, n in cells.items() if k.removeprefix("\\") not in names}
        for name, cells in names.items()
    }
