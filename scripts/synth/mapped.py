# SPDX-License-Identifier: BSD-3-Clause
"""The mapped netlist as something that runs: what yosys made of the core or a block for 7 series, cell by cell.

A count is worth nothing where the mapping is wrong, and yosys has packed adders into a DSP48 wrongly before (a
difference into the pre-adder without its signs; a sum with its own feedback).  The netlist is put together again from
yosys' own models of the cells.  Block RAM has no such model: tables are LUTs here, everything else is as counted.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from fluxproof.checkout import RTL
from fluxproof.cosim.verilated import VerilatedCore
from fluxproof.cosim.verilator import CACHE, compiled
from fluxproof.cosim.verilog import TOP, conversion_key, convert
from scripts.synth.yosys import SYNTH, part_of, version, yosys


def map_xc7(work: Path, modules: Sequence[str]) -> dict[str, str]:
    """Each of ``modules`` of ``work``/fluxproof.v after mapping, in Verilog without cells."""
    (work / "mapping.v").write_text(part_of((work / f"{TOP}.v").read_text(), modules))
    script = ["read_verilog mapping.v", "design -save converted"]
    for name in modules:
        script += ["design -load converted", SYNTH.format(family="xc7", top=name) + " -nobram"]
        script += ["write_verilog -noattr netlist.v", "design -reset"]
        script += ["read_verilog netlist.v", "read_verilog +/xilinx/cells_sim.v", f"hierarchy -top {name}"]
        # `flatten` puts the models in the cells' places; `proc` makes logic of what is written as a process in them.
        script += ["proc", "flatten", "opt_clean", f"write_verilog -noattr {name}_mapped.v"]
    yosys(script, work)
    return {name: (work / f"{name}_mapped.v").read_text() for name in modules}


def with_mapped(verilog: str, mapped: Mapping[str, str]) -> str:
    """``verilog`` with the text of each module in ``mapped`` in place of its own; ValueError where it has none."""
    parts = re.split(r"^(?=module )", verilog, flags=re.MULTILINE)
    places = {re.match(r"module (\w+)", text)[1]: k for k, text in enumerate(parts) if text.startswith("module ")}
    for module, text in mapped.items():
        if module not in places:
            raise ValueError(f"no module {module} in the converted Verilog")
        parts[places[module]] = text + "\n"
    return "".join(parts)


def build(generics: Mapping[str, int], modules: Sequence[str], rtl: Path = RTL) -> Path:
    """The folder with the compiled core, ``modules`` mapped and the rest as converted; made if it is not there yet."""
    source = convert(generics, CACHE.parent / "verilog" / conversion_key(generics, rtl), rtl)
    key = (Path(__file__).read_bytes(), SYNTH, version(), list(modules))

    def change(work: Path) -> None:
        verilog = work / f"{TOP}.v"
        verilog.write_text(with_mapped(verilog.read_text(), map_xc7(work, modules)))

    return compiled(source.read_bytes(), rtl, TOP, key, change)


class MappedCore(VerilatedCore):
    """A VerilatedCore in which ``modules`` of the converted Verilog are 7-series netlists; all of it by default."""

    _handle = None  # read when the object goes, also where the netlist could not be built

    def __init__(self, generics: Mapping[str, int], modules: Sequence[str] = (TOP,), rtl: Path = RTL):
        super().__init__(generics, rtl, TOP, folder=build(generics, modules, rtl))
