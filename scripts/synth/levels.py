# SPDX-License-Identifier: BSD-3-Clause
"""The longest path from register to register of each block of a netlist, in LUT levels and carry cells.

There is no delay of a wire in a netlist, so this is no timing.  WEIGHT decides which of a block's paths is the longest:
round figures in 0.1 ns for a cell and the wire behind it on a 7-series part (a carry cell has no such wire).
"multiply" is the multiplier of a DSP48E1, with or without its adder; "add" is its adder alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from scripts.synth.netlist import CONSTANTS, Bit, Cell, Netlist

WEIGHT = {"lut": 6, "carry4": 1, "muxf": 3, "memory": 8, "multiply": 30, "add": 15}
CLOCK_PINS = {"C", "CLK", "WCLK", "CLKARDCLK", "CLKBWRCLK", "REGCLKARDRCLK", "REGCLKB", "RDCLK", "WRCLK", "RDRCLK"}
# Asynchronous reads: address -> data goes through the cell as through a LUT.
READS = {
    **{f"RAM64M.{port}": f"ADDR{port[-1]}" for port in ("DOA", "DOB", "DOC", "DOD")},
    **{f"RAM32M.{port}": f"ADDR{port[-1]}" for port in ("DOA", "DOB", "DOC", "DOD")},
    **{"SRL16E.Q": "A"},
}

Arc = tuple[Bit, Bit, str]
"""(input bit, output bit, kind of cell in WEIGHT)"""


@dataclass(frozen=True)
class Path:
    """``cells``: how many of each kind lie between the register ``start`` and the register ``end``."""

    start: str
    end: str
    cells: dict[str, int]

    @property
    def weight(self) -> int:
        return sum(WEIGHT[kind] * number for kind, number in self.cells.items())


@dataclass(frozen=True)
class Pins:
    """What a cell is to a path: arcs through it, bits where a path starts and ends, with what they add inside it."""

    arcs: list[Arc]
    starts: list[tuple[Bit, str | None]]
    ends: list[tuple[Bit, str | None]]


def _all(side: dict[str, list[Bit]], leave: Iterable[str] = ()) -> list[Bit]:
    return [bit for port, bits in side.items() if port not in leave for bit in bits]


def _through(cell: Cell, kind: str) -> Pins:
    return Pins([(a, b, kind) for a in _all(cell.inputs) for b in _all(cell.outputs)], [], [])


def _carry(cell: Cell) -> Pins:
    """Bit n of the outputs depends on the inputs up to n only."""
    arcs = []
    for port, low in (("CI", 0), ("CYINIT", 0), *(("S", n) for n in range(4)), *(("DI", n) for n in range(4))):
        bits = cell.inputs.get(port, [])
        for bit in bits[low : low + 1] if port in ("S", "DI") else bits:
            for outputs in cell.outputs.values():
                arcs += [(bit, out, "carry4") for out in outputs[low:]]
    return Pins(arcs, [], [])


def _memory(cell: Cell) -> Pins:
    """Distributed RAM and shift registers: written at the clock, read at once."""
    starts = [(bit, None) for bit in _all(cell.outputs)]
    arcs = []
    for port, outputs in cell.outputs.items():
        address = READS.get(f"{cell.kind}.{port}")
        if address is None:
            raise ValueError(f"scripts/synth/levels.py does not know how {cell.kind} reads {port}; name it in READS")
        given = [bit for name, bits in cell.inputs.items() if name.rstrip("0123456789") == address for bit in bits]
        arcs += [(a, b, "memory") for a in given for b in outputs]
    return Pins(arcs, starts, [(bit, None) for bit in _all(cell.inputs, CLOCK_PINS)])


def _dsp(cell: Cell) -> Pins:
    """Multiplier and adder of a DSP48E1, as far as no register of its own cuts a path through them."""
    product, result = cell.number("MREG"), cell.number("PREG")
    out, arcs, ends, inside = _all(cell.outputs), [], [], False
    for port, bits in cell.inputs.items():
        if port in CLOCK_PINS:
            continue
        kind = "multiply" if port in "ABD" else "add"
        if port not in (*"ABCD", "PCIN") or cell.number(f"{port}REG"):
            inside |= port in (*"ABCD",)
            ends += [(bit, None) for bit in bits]
        elif result or (product and kind == "multiply"):
            ends += [(bit, kind) for bit in bits]
        else:
            arcs += [(bit, to, kind) for bit in bits for to in out]
    if result:
        return Pins(arcs, [(bit, None) for bit in out], ends)
    first = "add" if product else "multiply"
    return Pins(arcs, [(bit, first) for bit in out] if product or inside else [], ends)


def pins(cell: Cell) -> Pins:
    """How paths go through ``cell``; ValueError for a kind that is not known here."""
    if cell.kind.startswith("LUT") or cell.kind == "INV":
        return _through(cell, "lut")
    if cell.kind.startswith("MUXF"):
        return _through(cell, "muxf")
    if cell.kind == "CARRY4":
        return _carry(cell)
    if cell.kind == "DSP48E1":
        return _dsp(cell)
    if cell.kind.startswith(("FD", "RAMB")):
        ends = [(bit, None) for bit in _all(cell.inputs, CLOCK_PINS)]
        return Pins([], [(bit, None) for bit in _all(cell.outputs)], ends)
    if cell.kind.startswith(("RAM", "SRL")):
        return _memory(cell)
    raise ValueError(f"scripts/synth/levels.py knows no cell {cell.kind}; name it there")


def register_name(cell: Cell, bit: Bit, names: dict[int, list[str]]) -> str:
    """A register's net where it has a name; DSP48E1 and block RAM by kind and block."""
    if cell.kind.startswith(("DSP", "RAMB")):
        return f"{cell.kind} of {cell.block or 'the top'}"
    near = names.get(bit, [])
    own = [name for name in near if name.startswith(f"{cell.block}.")]
    return (own or near or [cell.name])[0]


def _ordered(arcs: dict[Bit, list[tuple[Bit, str]]]) -> Iterator[Bit]:
    try:
        yield from TopologicalSorter({out: [a for a, _ in given] for out, given in arcs.items()}).static_order()
    except CycleError as loop:
        raise ValueError(f"the netlist has a loop without a register: nets {loop.args[1]}") from None


def longest(netlist: Netlist) -> dict[str, Path]:
    """{block: its longest path}, by the block that the path ends in; paths from ports are left out."""
    into: dict[Bit, list[tuple[Bit, str]]] = {}
    # the best way to a bit: (weight, previous bit, kind of the cell between)
    best: dict[Bit, tuple[int, Bit | None, str | None]] = {}
    owner: dict[Bit, Cell] = {}
    ends: list[tuple[Cell, Bit, str | None]] = []
    for cell in netlist.cells:
        found = pins(cell)
        for given, out, kind in found.arcs:
            if given not in CONSTANTS and out not in CONSTANTS:
                into.setdefault(out, []).append((given, kind))
        for bit, kind in found.starts:
            best[bit], owner[bit] = (WEIGHT.get(kind, 0), None, kind), cell
        ends += [(cell, bit, kind) for bit, kind in found.ends if bit not in CONSTANTS]
    for bit in _ordered(into):
        for given, kind in into.get(bit, ()):
            if given in best and (bit not in best or best[given][0] + WEIGHT[kind] > best[bit][0]):
                best[bit] = (best[given][0] + WEIGHT[kind], given, kind)
    worst: dict[str, tuple[int, Cell, Bit, str | None]] = {}
    for cell, bit, kind in ends:
        if bit in best:
            weight = best[bit][0] + WEIGHT.get(kind, 0)
            if cell.block not in worst or weight > worst[cell.block][0]:
                worst[cell.block] = (weight, cell, bit, kind)
    return {
        block: _path(cell, bit, kind, best, owner, netlist.names)
        for block, (_, cell, bit, kind) in sorted(worst.items(), key=lambda item: -item[1][0])
    }


def _path(cell: Cell, bit: Bit, kind: str | None, best: dict, owner: dict, names: dict) -> Path:
    """The path that ``best`` keeps from its register to ``bit`` at ``cell``."""
    kinds, at = [kind], bit
    while at is not None:
        start = at
        _, at, kind = best[at]
        kinds.append(kind)
    outputs = _all(cell.outputs)
    end = register_name(cell, outputs[0] if outputs else bit, names)
    cells = {name: kinds.count(name) for name in WEIGHT}
    return Path(register_name(owner[start], start, names), end, cells)


def table(paths: dict[str, Path]) -> str:
    """A line per block, the longest path first."""
    lines = [f"{'block':26}" + "".join(f"{kind:>9}" for kind in WEIGHT) + "  from -> to"]
    for block, path in paths.items():
        numbers = "".join(f"{path.cells[kind]:9}" for kind in WEIGHT)
        lines.append(f"{block or 'top':26}{numbers}  {path.start} -> {path.end}")
    return "\n".join(lines)
