# SPDX-License-Identifier: BSD-3-Clause
"""A top with plain ports around an entity whose ports are records, for simulators that cannot see into a record.

A field becomes a port under its own name; the fields of sample_t keep the names and widths of sample_latch.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from pathlib import Path

from fluxproof.checkout import BUILD, RTL
from fluxproof.cosim.entity import Entity, Pin, read_entity
from fluxproof.files import write_text
from golden_model.records import ENTERS_AS, RECORDS, generic_of, vhdl_type

FLAT = "_flat"
FOLDER = BUILD / "flat"


def flat_top(entity: str, rtl: Path = RTL, extra: Collection[Path] = ()) -> tuple[str, list[Path]]:
    """(entity to simulate, further files): the entity itself, or a flat top, which is the further file.

    ``entity`` may also be the name of that top; its file is under ``rtl`` or in ``extra``.  Raises ValueError where
    there is none.
    """
    name = entity.removesuffix(FLAT)
    path = next((path for path in (*extra, *rtl.rglob(f"{name}.vhd")) if path.stem == name), None)
    if path is None:
        raise ValueError(f"no {name}.vhd under {rtl}")
    if not any(kind in path.read_text() for kind in RECORDS):  # the test top of a cell has generics without a default
        return entity, []
    found = read_entity(path)
    if not any(pin.kind in RECORDS for pin in found.pins.values()):
        return entity, []
    text = render(found)
    file = FOLDER / hashlib.sha256(text.encode()).hexdigest()[:16] / f"{name}{FLAT}.vhd"
    return name + FLAT, [file if file.exists() else write_text(file, text)]


def fields(pin: Pin) -> list[tuple[str, str, str]]:
    """[(plain port, its type, the expression for its value)] of a record port; the expression reads or is the field."""
    rows = []
    for field, port in RECORDS[pin.kind].items():
        place = f"{pin.name}_record.{field}"
        if pin.kind != "sample_t":
            rows.append((field, vhdl_type(port), place))
            continue
        name = ENTERS_AS[field]
        rows.append((name, vhdl_type(port, generic_of(name)), place))
    return rows


def render(entity: Entity) -> str:
    """The VHDL of the flat top; ValueError where two ports would get the same name."""
    ports, signals, before, actuals = [], [], [], []
    for pin in entity.pins.values():
        if pin.kind not in RECORDS:
            ports.append((pin.name, pin.mode, pin.vhdl_type))
            actuals.append((pin.name, pin.name))
            continue
        signals.append(f"  signal {pin.name}_record : {pin.kind};")
        actuals.append((pin.name, f"{pin.name}_record"))
        for name, kind, place in fields(pin):
            ports.append((name, pin.mode, kind))
            if not pin.is_input:
                before.append(f"  {name} <= {place};")
            elif kind == "std_logic":
                before.append(f"  {place} <= {name};")
            else:
                before.append(f"  {place} <= resize({name}, {place}'length);")
    names = [name for name, _, _ in ports]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"{entity.name}: two ports would be called {', '.join(twice)}")
    generics = [
        f"    {g.name} : {g.kind}{'' if g.low is None else f' range {g.low} to {g.high}'} := {g.default}"
        for g in entity.generics.values()
    ]
    mapped = ", ".join(f"{name} => {name}" for name in entity.generics)
    lines = ["library ieee;", "use ieee.std_logic_1164.all;", "use ieee.numeric_std.all;"]
    lines += ["use work.fluxproof_pkg.all;", "", f"entity {entity.name}{FLAT} is"]
    if generics:
        lines += ["  generic (", *";\n".join(generics).split("\n"), "  );"]
    # One port a line with a space before the type: the form that read_entity reads.
    lines += ["  port (", *";\n".join(f"    {n} : {mode} {kind}" for n, mode, kind in ports).split("\n"), "  );"]
    lines += [f"end entity {entity.name}{FLAT};", "", f"architecture test of {entity.name}{FLAT} is", *signals]
    lines += ["begin", *before, f"  inside : entity work.{entity.name}"]
    if generics:
        lines.append(f"    generic map ({mapped})")
    lines += ["    port map (", *",\n".join(f"      {a} => {b}" for a, b in actuals).split("\n"), "    );"]
    return "\n".join([*lines, "end architecture test;"]) + "\n"
