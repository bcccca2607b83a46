"""The VHDL files of the core in compile order, found from what they declare and use; no list to keep."""

from __future__ import annotations

import re
from collections.abc import Collection
from graphlib import TopologicalSorter
from pathlib import Path

from fluxproof.checkout import RTL

_COMMENT = re.compile(r"--[^\n]*")
_UNIT = re.compile(r"^\s*(package|entity)\s+(\w+)\s+is\b", re.IGNORECASE | re.MULTILINE)
_USE = re.compile(r"\bwork\.(\w+)", re.IGNORECASE)


def rtl_sources(rtl: Path = RTL, without: Collection[str] = ()) -> list[Path]:
    """Every ``*.vhd`` under ``rtl``: packages first, then each entity behind those it instantiates.

    Dependencies are all mentions of ``work.NAME``, which covers ``use work.P.all`` and ``entity work.E``.
    The order is the same on every machine; ``without``: names of files that are left out.  Raises ValueError where
    two files declare the same unit, and graphlib.CycleError where files need each other.
    """
    texts = {
        path: _COMMENT.sub("", path.read_text())
        for path in sorted(rtl.rglob("*.vhd"))
        if path.name not in without
    }
    declared_by: dict[str, Path] = {}
    packages = set()
    for path, text in texts.items():
        for kind, name in _UNIT.findall(text):
            other = declared_by.setdefault(name.lower(), path)
            if other != path:
                raise ValueError(f"{name} is declared in both {other.name} and {path.name}")
            if kind.lower() == "package":
                packages.add(path)
    order = TopologicalSorter()
    for path, text in texts.items():
        needs = {declared_by.get(name.lower()) for name in _USE.findall(text)} - {None, path}
        order.add(path, *sorted(needs))
    # The sort is stable and no package needs an entity, so moving packages ahead keeps the order valid.
    return sorted(order.static_order(), key=lambda path: path not in packages)
