# SPDX-License-Identifier: BSD-3-Clause
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


def _needs(paths: Collection[Path]) -> tuple[dict[Path, set[Path]], set[Path]]:
    """({file: files it needs}, files that declare a package); ValueError where two files declare the same unit.

    Dependencies are all mentions of ``work.NAME``, which covers ``use work.P.all`` and ``entity work.E``.
    """
    texts = {path: _COMMENT.sub("", path.read_text()) for path in paths}
    declared_by: dict[str, Path] = {}
    packages = set()
    for path, text in texts.items():
        for kind, name in _UNIT.findall(text):
            other = declared_by.setdefault(name.lower(), path)
            if other != path:
                raise ValueError(f"{name} is declared in both {other.name} and {path.name}")
            if kind.lower() == "package":
                packages.add(path)
    needs = {
        path: {declared_by[unit] for name in _USE.findall(text) if (unit := name.lower()) in declared_by} - {path}
        for path, text in texts.items()
    }
    return needs, packages


def rtl_sources(rtl: Path = RTL, without: Collection[str] = ()) -> list[Path]:
    """Every ``*.vhd`` under ``rtl``: packages first, then each entity behind those it instantiates.

    The order is the same on every machine; ``without``: names of files that are left out.  Raises ValueError where
    two files declare the same unit, and graphlib.CycleError where files need each other.
    """
    needs, packages = _needs([path for path in sorted(rtl.rglob("*.vhd")) if path.name not in without])
    order = TopologicalSorter()
    for path, needed in needs.items():
        order.add(path, *sorted(needed))
    # The sort is stable and no package needs an entity, so moving packages ahead keeps the order valid.
    return sorted(order.static_order(), key=lambda path: path not in packages)


def closure(toplevel: str, rtl: Path = RTL, extra: Collection[Path] = ()) -> list[Path]:
    """The files under ``rtl`` and in ``extra`` that the entity ``toplevel`` needs, sorted; its file bears its name.

    Raises ValueError where there is no such file, or two files declare the same unit.
    """
    needs, _ = _needs([*sorted(rtl.rglob("*.vhd")), *extra])
    waiting = [path for path in needs if path.stem == toplevel]
    if not waiting:
        raise ValueError(f"no {toplevel}.vhd under {rtl}")
    found: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += needs[path]
    return sorted(found)
