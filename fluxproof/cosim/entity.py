# SPDX-License-Identifier: BSD-3-Clause
"""Reads an entity's generics and ports from its VHDL: one declaration per line with its comment."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_ENTITY = re.compile(r"^entity\s+(\w+)\s+is\b(.*?)^end\s+entity", re.IGNORECASE | re.DOTALL | re.MULTILINE)
_GENERIC = re.compile(r"^\s*(\w+)\s*:\s*(\w+)(?:\s+range\s+(\w+)\s+to\s+(\w+))?\s*:=\s*(\w+)\s*;?\s*(?:--\s*(.*))?$")
_PORT = re.compile(
    r"^\s*(\w+)\s*:\s*(in|out|inout)\s+(\w+)(?:\((.+?)\s+downto\s+(\w+)\))?\s*;?\s*(?:--\s*(.*))?$",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Generic:
    """A generic with its default; ``low`` and ``high`` are None if only the type limits it."""

    name: str
    kind: str
    default: int
    low: int | None
    high: int | None
    doc: str


@dataclass(frozen=True)
class Pin:
    """A port; ``left`` is the text of its left bound, None for std_logic."""

    name: str
    mode: str
    kind: str
    left: str | None
    doc: str

    @property
    def is_input(self) -> bool:
        return self.mode == "in"

    @property
    def vhdl_type(self) -> str:
        return self.kind if self.left is None else f"{self.kind}({self.left} downto 0)"


@dataclass(frozen=True)
class Entity:
    """The declarations of a file: generics and ports by name, in order."""

    name: str
    generics: dict[str, Generic]
    pins: dict[str, Pin]

    @property
    def inputs(self) -> dict[str, Pin]:
        return {name: pin for name, pin in self.pins.items() if pin.is_input}

    @property
    def outputs(self) -> dict[str, Pin]:
        return {name: pin for name, pin in self.pins.items() if not pin.is_input}


def read_entity(path: Path) -> Entity:
    """The entity of ``path``; ValueError names a line that cannot be parsed."""
    return parse_entity(path.read_text(), path.name)


def parse_entity(text: str, file: str) -> Entity:
    """The entity in ``text``; ``file`` is its name in error messages."""
    found = _ENTITY.search(text)
    if found is None:
        raise ValueError(f"{file}: no entity")
    name, body = found.groups()
    generics: dict[str, Generic] = {}
    pins: dict[str, Pin] = {}
    part = None
    for line in body.splitlines():
        code = line.split("--")[0].strip().lower()
        if code in ("generic (", "port ("):
            part = code.split()[0]
        elif not code or code == ");":
            continue
        elif part == "generic" and (hit := _GENERIC.match(line)):
            key, kind, low, high, default, doc = hit.groups()
            generics[key] = Generic(key, kind.lower(), int(default), _number(low), _number(high), (doc or "").strip())
        elif part == "port" and (hit := _PORT.match(line)):
            key, mode, kind, left, right, doc = hit.groups()
            if right not in (None, "0"):
                raise ValueError(f"{file}: port {key} must end at bit 0: {line.strip()}")
            pins[key] = Pin(key, mode.lower(), kind.lower(), left, (doc or "").strip())
        else:
            raise ValueError(f"{file}: not understood in entity {name}: {line.strip()}")
    return Entity(name, generics, pins)


def _number(text: str | None) -> int | None:
    return None if text is None else int(text)
