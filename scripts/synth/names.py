"""What a register of the mapped netlist is called in the VHDL: block and signal.

yosys names a flip-flop after some net near it; its "src" attribute says in which line of the Verilog its process
stands, and GHDL writes ``assign prod_p_2 = n3120_q; // (signal)`` where the VHDL has a name for it.
"""

from __future__ import annotations

import json
import re
from bisect import bisect_right
from pathlib import Path

_MODULE = re.compile(r"^module (\w+)")
_ASSIGNED = re.compile(r"^\s*(\w+)(?:\[[^]]*\])?\s*<=")
_SIGNAL = re.compile(r"^\s*assign (\w+) = (\w+); // \(signal\)")
_LINE = re.compile(r"design\.v:(\d+)\.\d+-(\d+)\.\d+")
_TAIL = re.compile(r"_(?:TRELLIS_FF|MULT18X18D|CCU2C|LUT4|PFUMX|L6MUX21|DP16KD)|\$")


class Names:
    """Names of the registers of ``folder``/design.json, made of ``folder``/design.v."""

    def __init__(self, folder: Path, top: str):
        netlist = json.loads((folder / "design.json").read_text())
        self._cells = netlist["modules"][top]["cells"]
        self._lines = (folder / "design.v").read_text().splitlines()
        self._starts, self._modules, self._signals = [], [], {}
        for number, line in enumerate(self._lines, 1):
            if found := _MODULE.match(line):
                self._starts.append(number)
                self._modules.append(found.group(1))
            elif (found := _SIGNAL.match(line)) and self._modules:
                self._signals[self._modules[-1], found.group(2)] = found.group(1)
        self._top = top

    def register(self, cell: str) -> str:
        """``module.signal`` of a flip-flop; the wrapper's own registers are "port NAME"."""
        near, known = _TAIL.split(cell, maxsplit=1)[0], self._cells.get(cell, {})
        found = _LINE.search(known.get("attributes", {}).get("src", ""))
        if known.get("type") == "DP16KD":
            return f"block RAM {near}"
        if not found:
            return near
        first, last = int(found.group(1)), int(found.group(2))
        module = self._modules[bisect_right(self._starts, first) - 1]
        if module == self._top:
            return f"port {near.removeprefix('dut.')}"
        for line in self._lines[first - 1 : last]:
            if assigned := _ASSIGNED.match(line):
                net = assigned.group(1)
                return f"{module}.{self._signals.get((module, net), net)}"
        return near
