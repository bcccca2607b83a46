"""What nextpnr's SDF says of a packed ECP5 design's cells: ps from clock to output, pin to pin, before the clock."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

_PATH = re.compile(r"\(IOPATH (?:\(\w+ (\w+)\)|(\w+)) (\w+) \((\d+):(\d+):(\d+)\)")
_CHECK = re.compile(r"\(SETUPHOLD \(posedge (\w+)\) \(\w+ \w+\) \((\d+):(\d+):(\d+)\)")
HALVES = "$CCU2_COMB0", "$CCU2_COMB1"  # what the cells of a carry chain's slice end with
CLOCK = "CLK"  # what the clock's pins begin with


@dataclass
class CellDelays:
    """Slowest corner, ps; a pin is (cell, port)."""

    clocked: dict[tuple[str, str], int] = field(default_factory=dict)  # output: after the clock
    through: dict[tuple[str, str], list[tuple[str, int]]] = field(default_factory=lambda: defaultdict(list))
    before: dict[tuple[str, str], int] = field(default_factory=dict)  # input: before the clock


def read_again(delays: CellDelays, share: float = 1.0) -> CellDelays:
    """``delays`` as nextpnr takes them for a design that it reads packed, or a ``share`` of what that adds: it has
    forgotten which half of a slice a step of a carry chain is, and takes each for the first, a chain for twice as slow.
    """
    slowest: dict[str, int] = {}
    for (cell, pin), ways in delays.through.items():
        if cell.endswith(HALVES[0]) and pin == "FCI":
            slowest |= {output: max(ps, slowest.get(output, 0)) for output, ps in ways}
    through = {
        (cell, pin): [(out, round(ps + share * max(0, slowest.get(out, 0) - ps))) for out, ps in ways]
        if cell.endswith(HALVES[1]) and pin == "FCI" else ways
        for (cell, pin), ways in delays.through.items()
    }  # fmt: skip
    return CellDelays(delays.clocked, through, delays.before)


def read(path: Path) -> CellDelays:
    """The cells' part of an SDF file; ValueError with file and line where there is a delay of no cell."""
    found, cell = CellDelays(), ""
    with path.open() as lines:
        for number, line in enumerate(lines, 1):
            text = line.lstrip()
            if text.startswith("(INSTANCE"):
                cell = text[len("(INSTANCE") :].strip().rstrip(")").replace("\\", "")
            elif path_given := _PATH.match(text):
                if not cell:
                    raise ValueError(f"{path}:{number}: a delay before any (INSTANCE name)")
                edge, plain, output, *_, slowest = path_given.groups()
                pin = edge or plain
                if pin.startswith(CLOCK):
                    found.clocked[cell, output] = max(int(slowest), found.clocked.get((cell, output), 0))
                else:
                    found.through[cell, pin].append((output, int(slowest)))
            elif check := _CHECK.match(text):
                found.before[cell, check.group(1)] = int(check.group(4))
    return found
