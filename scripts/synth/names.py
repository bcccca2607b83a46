"""What a register of the mapped netlist is called in the VHDL: block and signal.

yosys names a flip-flop after some net near it; its "src" attribute says in which line of the Verilog its process
stands, and GHDL writes ``assign prod_p_2 = n3120_q; // (signal)`` where the VHDL has a name for it.
"""

from __future__ import annotations

import json
import re
from bisect import bisect_right
from pathlib import Path

from scripts.synth.fan_out import COPY
from scripts.synth.wrapper import NAME, chains

_MODULE = re.compile(r"^module (\w+)")
_ASSIGNED = re.compile(r"^\s*(\w+)(?:\[[^]]*\])?\s*<=")
_SIGNAL = re.compile(r"^\s*assign (\w+) = (\w+); // \(signal\)")
_VHDL = re.compile(r"/\* (\S+\.vhd:\d+)")
_LINE = re.compile(r"design\.v:(\d+)\.\d+-(\d+)\.\d+")
_TAIL = re.compile(r"_(?:TRELLIS_FF|MULT18X18D|CCU2C|LUT4|PFUMX|L6MUX21|DP16KD)|\$")


class Names:
    """Names of the registers of ``folder``/design.json, made of ``folder``/design.v, top ``shifted``."""

    def __init__(self, folder: Path, module: str):
        netlist = json.loads((folder / "design.json").read_text())
        self._cells = netlist["modules"][NAME]["cells"]
        nets = netlist["modules"][NAME]["netnames"]
        self._chain = {
            b: (c, n) for c in ("given", "taken") for n, b in enumerate(nets.get(c, {}).get("bits", []))
        }
        self._ports = chains((folder / "design.v").read_text(), module)
        self._lines = (folder / "design.v").read_text().splitlines()
        self._starts, self._modules, self._signals = [], [], {}
        for number, line in enumerate(self._lines, 1):
            if found := _MODULE.match(line):
                self._starts.append(number)
                self._modules.append(found.group(1))
            elif (found := _SIGNAL.match(line)) and self._modules:
                self._signals[self._modules[-1], found.group(2)] = found.group(1)

    def _port(self, bit: int, near: str) -> str:
        """``input NAME`` or ``output NAME`` that a register of the wrapper stands for."""
        chain, place = self._chain.get(bit, ("", 0))
        if not chain:
            return near
        members = self._ports["given" if chain == "given" else "made"]
        name = members[bisect_right([low for _, low in members], place) - 1][0]
        return f"{'input' if chain == 'given' else 'output'} {name}"

    def register(self, cell: str) -> str:
        """``module.signal`` of a flip-flop; "multiplier of FILE:LINE"; the wrapper's: "input NAME", "output NAME"."""
        cell = cell.split(COPY, maxsplit=1)[0]
        near, known = _TAIL.split(cell, maxsplit=1)[0], self._cells.get(cell, {})
        found = _LINE.search(known.get("attributes", {}).get("src", ""))
        if not found:
            return f"block RAM {near}" if known.get("type") == "DP16KD" else near
        first, last = int(found.group(1)), int(found.group(2))
        module = self._modules[bisect_right(self._starts, first) - 1]
        if module == NAME:
            return self._port(known["connections"]["Q"][0], near)
        for line in self._lines[first - 1 : last]:
            if assigned := _ASSIGNED.match(line):
                net = assigned.group(1)
                return f"{module}.{self._signals.get((module, net), net)}"
        vhdl = next((m for line in self._lines[first - 1 :: -1] if (m := _VHDL.search(line))), None)
        kind = "multiplier" if known["type"] == "MULT18X18D" else known["type"]
        return f"{kind} of {vhdl.group(1)}" if vhdl else near
