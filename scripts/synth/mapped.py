"""The mapped netlist as something that runs: what yosys made of the core for Xilinx, cell by cell, in Verilator.

A count is worth nothing where the mapping is wrong, and yosys has packed adders into a DSP48 wrongly before (a
difference into the pre-adder without its signs; a sum with its own feedback).  The netlist is put together again from
yosys' own models of the cells.  Block RAM has no such model: tables are LUTs here, everything else is as counted.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from scripts.sources import RTL
from scripts.synth.yosys import SYNTH, version, yosys
from scripts.verilated import CACHE, VerilatedCore, compiled
from scripts.verilog import TOP, conversion_key, convert


def scripts_for(family: str, top: str) -> tuple[list[str], list[str]]:
    """yosys' commands that map ``top``.v into netlist.v, and those that turn that into mapped.v without cells."""
    mapping = [
        f"read_verilog {top}.v",
        SYNTH.format(family=family, top=top) + " -nobram",
        "write_verilog -noattr netlist.v",
    ]
    # `flatten` puts the models in the cells' places; `proc` makes logic of what is written as a process in them.
    models = [
        "read_verilog netlist.v",
        "read_verilog +/xilinx/cells_sim.v",
        f"hierarchy -top {top}",
        "proc",
        "flatten",
    ]
    return mapping, [*models, "opt_clean", "write_verilog -noattr mapped.v"]


def build(generics: Mapping[str, int], family: str, rtl: Path = RTL, top: str = TOP) -> Path:
    """The folder with the compiled netlist and ``top``.v, made if it is not there yet."""
    source = convert(generics, CACHE.parent / "verilog" / conversion_key(generics, rtl, top), rtl, top)
    scripts = scripts_for(family, top)

    def map_it(work: Path) -> None:
        for script in scripts:
            yosys(script, work)
        os.replace(work / "mapped.v", work / f"{top}.v")

    return compiled(source.read_bytes(), rtl, top, (scripts, version()), map_it)


class MappedCore(VerilatedCore):
    """A VerilatedCore whose inside is the netlist for ``family``."""

    def __init__(self, generics: Mapping[str, int], family: str = "xc7", rtl: Path = RTL, top: str = TOP):
        super().__init__(generics, rtl, top, folder=build(generics, family, rtl, top))
