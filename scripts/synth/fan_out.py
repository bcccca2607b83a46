"""Copies a register or a LUT that more cells read than one place in the chip is near to, and shares its readers out.

A valid bit enables dozens of flip-flops and chooses for dozens of LUTs; a reset reaches thousands.  nextpnr keeps one
such cell in one place.  Readers are shared out in the order of the registers they lead to, by the names that the blocks
and registers of the VHDL gave those: what serves one register stays together, and so does what serves one block.

A LUT has one flip-flop beside it.  Where several take what it makes, all but one are behind a net of their own; those
get a LUT of their own if it is late.
"""

from __future__ import annotations

from scripts.synth.delays import Delays
from scripts.synth.netlist import Nets

FLIP_FLOP, LUT = "TRELLIS_FF", "LUT4"
OUTPUT = {FLIP_FLOP: "Q", LUT: "Z", "PFUMX": "Z", "L6MUX21": "Z"}
INSIDE = {"PFUMX": ("ALUT", "BLUT"), "L6MUX21": ("D0", "D1")}  # by wires of the slice: their makers go along
MOST = 16  # readers of one copy
LATE = 4.5  # ns after the clock at which a net more in front of a flip-flop is one too many: behind three LUTs
COPY = "_copy_"  # stands in a copy's name behind that of the cell it copies


class Copies:
    """The cells of a netlist, and more of them."""

    def __init__(self, module: dict):
        self.cells, self.nets, self.added = module["cells"], Nets(module), 0

    def register(self, name: str) -> str:
        """What a cell leads to: itself, or through LUTs the first by name of those that read it."""
        seen = set()
        while name and name not in seen and self.cells[name]["type"] in (LUT, *INSIDE):
            seen.add(name)
            (made,) = self.cells[name]["connections"][OUTPUT[self.cells[name]["type"]]]
            name = min((reader for reader, _ in self.nets.readers.get(made, [])), default=name)
        return name

    def copy(self, bit: int) -> int:
        """A bit made by a copy of what makes ``bit``, without readers."""
        name, made = self.nets.driver[bit], self.nets.free
        self.nets.free += 1
        self.added += 1
        model = self.cells[name]
        connections = {**model["connections"], OUTPUT[model["type"]]: [made]}
        for port in INSIDE.get(model["type"], ()):
            connections[port] = [self.copy(connections[port][0])]
        copy = f"{name}{COPY}{made}"
        self.cells[copy] = {**model, "connections": connections}
        self.nets.driver[made] = copy
        for port, (source, *_) in connections.items():
            if port != OUTPUT[model["type"]] and not isinstance(source, str):
                self.nets.readers[source].append((copy, port))
        return made

    def hand_over(self, bit: int, readers: list[tuple[str, str]]) -> None:
        """``readers`` of ``bit`` read a copy of it from now on."""
        made = self.copy(bit)
        for cell, port in readers:
            connections = self.cells[cell]["connections"]
            moved = [made if old == bit else old for old in connections[port]]
            self.cells[cell]["connections"] = {**connections, port: moved}
            self.nets.readers[bit].remove((cell, port))
            self.nets.readers[made].append((cell, port))


def share_out(netlist: dict, top: str, most: int = MOST) -> int:
    """Changes ``netlist`` in place; how many copies were added."""
    copies = Copies(netlist["modules"][top])
    cells, nets = copies.cells, copies.nets
    delays = Delays(cells, nets)
    late = {bit for bit in nets.driver if delays.arrival(bit) > LATE}
    own_luts(copies, late)
    waiting = sorted(nets.driver)
    while waiting:
        bit = waiting.pop()
        model = cells[nets.driver[bit]]
        readers = sorted(nets.readers.get(bit, []), key=lambda reader: (copies.register(reader[0]), reader))
        connections = model["connections"]
        if len(readers) <= most or model["type"] not in (FLIP_FLOP, LUT) or any(not cell for cell, _ in readers):
            continue
        if model.get("attributes", {}).get("keep") or connections.get("DI", [None])[0] in late:
            continue
        share = -(-len(readers) // -(-len(readers) // most))
        for start in range(share, len(readers), share):
            copies.hand_over(bit, readers[start : start + share])
        # What the copies read has more readers now.
        waiting += [source for (source, *_) in connections.values() if source != bit and source in nets.driver]
    return copies.added


def own_luts(copies: Copies, late: set[int]) -> None:
    """Gives each flip-flop that takes a late bit of a LUT one of its own."""
    for bit in sorted(late):
        if copies.cells[copies.nets.driver[bit]]["type"] in (LUT, *INSIDE):
            takers = [(cell, port) for cell, port in copies.nets.readers.get(bit, []) if cell and port == "DI"]
            for taker in takers[1:]:
                if copies.cells[taker[0]]["type"] == FLIP_FLOP:
                    copies.hand_over(bit, [taker])
