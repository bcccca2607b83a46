# SPDX-License-Identifier: BSD-3-Clause
"""Which DSP48E1 of a netlist has registers at its operands and at its product or sum."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from scripts.synth.netlist import CONSTANTS, Bit, Cell, Netlist

KIND = "DSP48E1"
INSIDE = ("register", "constant")


@dataclass(frozen=True)
class Multiplier:
    """One DSP48E1.

    ``operands``: where each of A, B and, with the pre-adder in use, D comes from: "register" (inside the DSP48E1),
    "constant", "flip-flops" (outside), "block RAM", "DSP48E1", "input" (a port of the netlist) or "logic" (a LUT or a
    carry cell); ``addend``: the same for C, "" where C is not in use; ``result``: those of MREG and PREG that are on.
    """

    block: str
    source: str
    operands: dict[str, str]
    addend: str
    result: tuple[str, ...]

    @property
    def missing(self) -> list[str]:
        """Operands and result without a register, in words; empty where all have one."""
        words = [f"{port} from {origin}" for port, origin in self.operands.items() if origin not in INSIDE]
        return words + ([] if self.result else ["product and sum"])


def _origin(cell: Cell, port: str, drivers: dict[Bit, Cell]) -> str:
    """Where an operand comes from; the worst of its bits decides."""
    bits = [bit for bit in cell.inputs.get(port, ()) if bit not in CONSTANTS]
    if not bits:
        return "constant"
    if cell.number(f"{port}REG"):
        return "register"
    kinds = {drivers[bit].kind if bit in drivers else "input" for bit in bits}
    known = {"FD": "flip-flops", "RAMB": "block RAM", KIND: KIND, "input": "input"}
    origins = {next((word for start, word in known.items() if kind.startswith(start)), "logic") for kind in kinds}
    return next(word for word in ("logic", "input", KIND, "block RAM", "flip-flops") if word in origins)


def multipliers(netlist: Netlist) -> list[Multiplier]:
    """Every DSP48E1, by block."""
    drivers, found = netlist.drivers(), []
    for cell in netlist.cells:
        if cell.kind == KIND:
            ports = "ABD" if cell.parameters.get("USE_DPORT") == "TRUE" else "AB"
            operands = {port: _origin(cell, port, drivers) for port in ports}
            addend = _origin(cell, "C", drivers).replace("constant", "")
            result = tuple(register for register in ("MREG", "PREG") if cell.number(register))
            found.append(Multiplier(cell.block, cell.source, operands, addend, result))
    return sorted(found, key=lambda one: (one.block, one.source))


def summary(found: Sequence[Multiplier]) -> dict:
    """The "dsp" part of paths.json."""
    return {
        "number": len(found),
        "product_or_sum_registered": sum(bool(one.result) for one in found),
        "operands_registered": sum(all(o in INSIDE for o in one.operands.values()) for one in found),
        "addends": dict(Counter(one.addend for one in found if one.addend)),
        "without": [{**asdict(one), "missing": one.missing} for one in found if one.missing],
    }


def table(found: Sequence[Multiplier]) -> str:
    """Counts in the first lines, then a line for each DSP48E1 that lacks a register."""
    counts = summary(found)
    addends = ", ".join(f"{number} from {origin}" for origin, number in counts["addends"].items())
    lines = [
        f"{counts['number']} {KIND}: {counts['product_or_sum_registered']} with a register at product or sum, "
        f"{counts['operands_registered']} with one at every operand; C: {addends or 'not used'}",
    ]
    return "\n".join(lines + [f"  {m.block:28}{m.source:38}{', '.join(m.missing)}" for m in found if m.missing])
