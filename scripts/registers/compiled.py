# SPDX-License-Identifier: BSD-3-Clause
"""The contents of the SystemRDL file, read by systemrdl-compiler, as plain tuples for the templates."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from systemrdl import RDLCompiler
from systemrdl.node import AddrmapNode, FieldNode, RegNode


class Part(NamedTuple):
    """One field; ``low`` and ``high`` are None if software cannot write."""

    name: str
    bit: int
    width: int
    doc: str
    unit: str
    format: str
    port: str
    port_width: int
    signed: bool
    low: int | None
    high: int | None

    @property
    def vhdl_type(self) -> str:
        """The core's type of the port: one bit U(1,0) is a std_logic."""
        if self.format == "U(1,0)":
            return "std_logic"
        return f"{'signed' if self.signed else 'unsigned'}({self.port_width - 1} downto 0)"


class Word(NamedTuple):
    """One register."""

    name: str
    address: int
    kind: str
    doc: str
    reset: int
    needs: str
    parts: tuple[Part, ...]

    @property
    def index(self) -> int:
        return self.address // 4


def compile_file(path: Path) -> AddrmapNode:
    """The elaborated address map; systemrdl's own message and exception if the file is invalid."""
    compiler = RDLCompiler()
    compiler.compile_file(str(path))
    return compiler.elaborate().top


def words(top: AddrmapNode) -> list[Word]:
    """Every register of the map in the order of the addresses."""
    return [_word(node) for node in top.children() if isinstance(node, RegNode)]


def _word(node: RegNode) -> Word:
    parts = tuple(_part(field) for field in node.fields())
    reset = node.fields()[0].get_property("reset") or 0
    return Word(
        node.inst_name,
        node.absolute_address,
        node.get_property("kind"),
        node.get_property("desc"),
        reset,
        node.get_property("needs") or "",
        parts,
    )


def _part(node: FieldNode) -> Part:
    get = node.get_property
    return Part(
        node.inst_name,
        node.low,
        node.width,
        get("desc") or node.parent.get_property("desc"),
        get("unit"),
        get("format"),
        get("port"),
        get("port_width"),
        bool(get("is_signed")),
        _twos_complement(get("low")),
        _twos_complement(get("high")),
    )


def _twos_complement(value: int | None) -> int | None:
    return value if value is None or value < 1 << 31 else value - (1 << 32)
