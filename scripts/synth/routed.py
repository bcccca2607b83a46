"""The slowest path of a routed ECP5 design by nextpnr's own delays: its cells' as packed, its wires' as routed.

nextpnr's own report on a design that it read packed counts every carry chain for twice as slow as it is
(`sdf.read_again`).  Reckoned with that, what is found here is what the report says, and this is looked at each time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scripts.synth import sdf
from scripts.synth.paths import Paths

Pin = tuple[str, str]  # cell, port
_WIRE = re.compile(r"\(INTERCONNECT (\S+)/(\w+) (\S+)/(\w+) \(\d+:\d+:(\d+)\)")


@dataclass(frozen=True)
class Slowest:
    """A register to register path: the pins that drive along it, the cell at its end, ns, and ns in cells."""

    pins: list[Pin]
    end: str
    delay: float
    logic: float


def wires(path: Path) -> dict[Pin, int]:
    """ps from what drives a pin to it, slowest corner, for every input pin in an SDF file; ValueError without any."""
    found = {}
    with path.open() as lines:
        for line in lines:
            if wire := _WIRE.match(line.lstrip()):
                found[wire[3].replace("\\", ""), wire[4]] = int(wire[5])
    if not found:
        raise ValueError(f"{path}: no (INTERCONNECT ...) in it, as in an SDF of nextpnr after routing")
    return found


def slowest(cells: dict, delays: sdf.CellDelays, wire_ps: dict[Pin, int]) -> Slowest:
    """``cells`` as in nextpnr's JSON; KeyError where a pin between registers has no wire."""
    paths = Paths(cells, {name: n for n, name in enumerate(cells)}, delays, by_pin=True)
    pins, end, total, on_wires = paths.worst(np.array([wire_ps[pin] for pin in paths.pins], float))
    return Slowest(pins, end, total / 1000, (total - on_wires) / 1000)
