"""Static timing of a placed ECP5 design whose wires' delays are those of a table: the slowest path over each wire.

A node is a pin that drives.  An arc goes from a node over a wire and through a cell to the next; a wire joins two cells
once, however many pins it ends at, and those inside a slice take nothing.  By pins, each pin has a wire of its own,
inside a slice too.  Times in ps.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numba import njit

from scripts.synth.sdf import CellDelays

# Inputs that are reached inside a slice, and those of distributed memory, which never moves
INSIDE = frozenset({"FCI", "F1", "FXA", "FXB", "DI", *(f"WAD{n}" for n in range(4)), "WD"})
NEVER = -1e9  # of a node that no clock reaches, and of a wire without a path


class Paths:
    """The wires of a design, and the arcs over them in an order in which each follows those before it."""

    def __init__(self, cells: dict, number: dict[str, int], delays: CellDelays, by_pin: bool = False):
        driver = {
            bits[0]: (name, port)
            for name, cell in cells.items()
            for port, bits in cell["connections"].items()
            if bits and cell["port_directions"][port] == "output"
        }
        nodes = {pin: n for n, pin in enumerate(sorted(set(driver.values())))}
        wires: dict[tuple, int] = {}
        arcs, ends, behind = [], [], defaultdict(list)
        for name, cell in cells.items():
            for port, bits in cell["connections"].items():
                if not bits or cell["port_directions"][port] != "input" or bits[0] not in driver:
                    continue
                through, before = delays.through.get((name, port), ()), delays.before.get((name, port))
                maker, output = driver[bits[0]]
                if (not through and before is None) or "TRELLIS_IO" in (cell["type"], cells[maker]["type"]):
                    continue
                node, wire = nodes[maker, output], -1
                if by_pin or port not in INSIDE:
                    wire = wires.setdefault((node, name, port if by_pin else ""), len(wires))
                for made, ps in through:
                    if (name, made) in nodes:
                        behind[node].append(len(arcs))
                        arcs.append((node, nodes[name, made], ps, wire))
                if before is not None:
                    ends.append((node, before, wire))
        rank = _order(len(nodes), arcs, behind)
        arcs.sort(key=lambda arc: rank[arc[0]])
        drives = [node for node, *_ in wires]
        self.source = np.array([number[name] for name, _ in nodes])[drives]
        self.sink = np.array([number[name] for _, name, _ in wires])
        self.readers = np.bincount(drives, minlength=len(nodes))[drives]
        self.pins = [(name, port) for _, name, port in wires]  # of each wire, by pins
        self.drivers = list(nodes)  # of each node
        self.start = np.array([delays.clocked.get(pin, NEVER) for pin in nodes], float)
        self._arcs = tuple(np.array(column) for column in zip(*arcs, strict=True))
        self._ends = tuple(np.array(column) for column in zip(*ends, strict=True))

    def slowest(self, wire_ps: np.ndarray) -> tuple[float, np.ndarray]:
        """(the slowest path, the slowest over each wire), ps, the wires taking ``wire_ps``."""
        over = np.full(len(self.source), NEVER)
        return _run(*self._arcs, *self._ends, self.start, wire_ps, over), over

    def worst(self, wire_ps: np.ndarray) -> tuple[list[tuple[str, str]], str, float, float]:
        """(pins that drive along the slowest path, the cell that it ends at, ps of it, ps of it on wires), by pins."""
        arrival, came = self.start.copy(), {}
        for first, then, ps, wire in zip(*self._arcs, strict=True):
            if arrival[first] + wire_ps[wire] + ps > arrival[then]:
                arrival[then] = arrival[first] + wire_ps[wire] + ps
                came[then] = first, wire
        node, before, wire = (np.array(column) for column in self._ends)
        times = arrival[node] + wire_ps[wire] + before
        last = int(times.argmax())
        at, on_wires, driving = int(node[last]), wire_ps[wire[last]], []
        while True:
            driving.append(self.drivers[at])
            if at not in came:
                break
            at, over = came[at]
            on_wires += wire_ps[over]
        return driving[::-1], self.pins[wire[last]][0], float(times[last]), float(on_wires)


def _order(count: int, arcs: list[tuple], behind: dict[int, list[int]]) -> list[int]:
    """A number for each node, larger than those of the nodes before it; ValueError at a loop."""
    before = np.bincount([arc[1] for arc in arcs], minlength=count).tolist()
    ready, rank = [node for node in range(count) if not before[node]], [-1] * count
    for n, node in enumerate(ready):  # grows on the way
        rank[node] = n
        for arc in behind[node]:
            after = arcs[arc][1]
            before[after] -= 1
            if not before[after]:
                ready.append(after)
    if len(ready) != count:
        raise ValueError(f"a loop through {count - len(ready)} pins without a register")
    return rank


@njit(cache=True, nogil=True)
def _run(first, then, ps, wire, last, before, last_wire, start, wire_ps, over):
    arrival, rest, slowest = start.copy(), np.full(len(start), NEVER), 0.0
    for k in range(len(first)):
        t = arrival[first[k]] + ps[k] + (wire_ps[wire[k]] if wire[k] >= 0 else 0.0)
        arrival[then[k]] = max(arrival[then[k]], t)
    for k in range(len(last)):
        t = before[k] + (wire_ps[last_wire[k]] if last_wire[k] >= 0 else 0.0)
        rest[last[k]] = max(rest[last[k]], t)
        slowest = max(slowest, arrival[last[k]] + t)
        if last_wire[k] >= 0:
            over[last_wire[k]] = max(over[last_wire[k]], arrival[last[k]] + t)
    for k in range(len(first) - 1, -1, -1):
        t = rest[then[k]] + ps[k] + (wire_ps[wire[k]] if wire[k] >= 0 else 0.0)
        rest[first[k]] = max(rest[first[k]], t)
        if wire[k] >= 0:
            over[wire[k]] = max(over[wire[k]], arrival[first[k]] + t)
    return slowest
