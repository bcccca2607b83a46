"""Copies a register or a LUT that more cells read than one place in the chip is near to, and shares its readers out.

A valid bit enables dozens of flip-flops and chooses for dozens of LUTs; a reset reaches thousands.  nextpnr keeps one
such cell in one place.  Readers are shared out in the order of the registers they lead to, by the names that the blocks
and registers of the VHDL gave those: what serves one register stays together, and so does what serves one block.  A
strobe that starts several blocks is copied for each, unless they are more than a copy may have readers.

What is reset shares few copies of the reset, apart from what else reads it: flip-flops of a tile must have one.

A multiplier without operands' registers leaves little for the net in front of it: a register that comes from another
one, so that there is time for a net more before it, is copied for each block where it feeds such a multiplier.

A LUT has one flip-flop beside it.  Where several take what it makes, all but one are behind a net of their own; those
get a LUT of their own if it is late.
"""

from __future__ import annotations

from itertools import groupby

from scripts.synth.delays import TO_Q, Delays
from scripts.synth.netlist import Nets

FLIP_FLOP, LUT, MULTIPLIER = "TRELLIS_FF", "LUT4", "MULT18X18D"
OUTPUT = {FLIP_FLOP: "Q", LUT: "Z", "PFUMX": "Z", "L6MUX21": "Z"}
INSIDE = {"PFUMX": ("ALUT", "BLUT"), "L6MUX21": ("D0", "D1")}  # by wires of the slice: their makers go along
MOST = 16  # readers of one copy
LATE = 4.5  # ns after the clock at which a net more in front of a flip-flop is one too many: behind three LUTs
MOST_RESET = 160  # flip-flops that one copy resets: those of a tile share one reset, so few are better than near ones
MOST_LATE = 48  # readers of one copy where what it takes is late: each copy is one more that waits for it
COPY = "_copy_"  # stands in a copy's name behind that of the cell it copies


class Copies:
    """The cells of a netlist, and more of them."""

    def __init__(self, module: dict):
        self.cells, self.nets, self.added = module["cells"], Nets(module), 0
        self.read_more: list[int] = []  # what copies read: it has more readers than before

    def register(self, name: str) -> str:
        """What a cell leads to: itself, or through LUTs the first by name of those that read it."""
        seen = set()
        while name and name not in seen and self.cells[name]["type"] in (LUT, *INSIDE):
            seen.add(name)
            (made,) = self.cells[name]["connections"][OUTPUT[self.cells[name]["type"]]]
            name = min((reader for reader, _ in self.nets.readers.get(made, [])), default=name)
        return name

    def order(self, reader: tuple[str, str]) -> tuple:
        """By blocks, in each the multipliers first, as a site's four share their enables, then by registers."""
        register = self.register(reader[0])
        return block_of(register), self.cells.get(reader[0], {"type": ""})["type"] != MULTIPLIER, register, reader

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
                self.read_more.append(source)
        return made

    def hand_over(self, bit: int, readers: list[tuple[str, str]]) -> int:
        """``readers`` of ``bit`` read a copy of it from now on, which is returned."""
        made = self.copy(bit)
        for cell, port in readers:
            connections = self.cells[cell]["connections"]
            moved = [made if old == bit else old for old in connections[port]]
            self.cells[cell]["connections"] = {**connections, port: moved}
            self.nets.readers[bit].remove((cell, port))
            self.nets.readers[made].append((cell, port))
        return made


def share_out(netlist: dict, top: str, most: int = MOST) -> int:
    """Changes ``netlist`` in place; how many copies were added."""
    copies = Copies(netlist["modules"][top])
    cells, nets = copies.cells, copies.nets
    delays = Delays(cells, nets)
    late = {bit for bit in nets.driver if delays.arrival(bit) > LATE}
    own_luts(copies, late)
    beside_multipliers(copies, delays)
    waiting = sorted(nets.driver)
    while waiting:
        bit = waiting.pop()
        model = cells[nets.driver[bit]]
        readers = sorted(nets.readers.get(bit, []), key=copies.order)
        connections = model["connections"]
        resets = [reader for reader in readers if reader[1] == "LSR"]
        limit = MOST_LATE if connections.get("DI", [None])[0] in late else most
        if len(resets) == len(readers):
            limit = MOST_RESET
        if len(readers) <= limit or model["type"] not in OUTPUT or any(not cell for cell, _ in readers):
            continue
        if model.get("attributes", {}).get("keep"):
            continue
        if 0 < len(resets) < len(readers):
            waiting += [bit, copies.hand_over(bit, resets)]
            continue
        blocks = [block_of(copies.register(cell)) for cell, _ in readers]
        apart = model["type"] == FLIP_FLOP and len(set(blocks)) <= most
        for share in shares(list(zip(blocks, readers, strict=True)), limit, apart)[1:]:
            copies.hand_over(bit, [reader for _, reader in share])
        waiting += [source for source in copies.read_more if source != bit and source in nets.driver]
        copies.read_more.clear()
    return copies.added


def block_of(name: str) -> str:
    """The block that a cell is in, by its name."""
    return name.rpartition(".")[0]


def shares(readers: list[tuple], most: int, apart: bool) -> list[list[tuple]]:
    """``readers``, (block, reader) in order, in parts of at most ``most``; a block is cut only where it alone has
    more.  ``apart``: no part serves two blocks."""
    parts: list[list[tuple]] = [[]]
    for _, group in groupby(readers, lambda reader: reader[0]):
        members = list(group)
        size = -(-len(members) // -(-len(members) // most))
        for start in range(0, len(members), size):
            part = members[start : start + size]
            if parts[-1] and (apart or len(parts[-1]) + len(part) > most):
                parts.append([])
            parts[-1] += part
    return parts


def beside_multipliers(copies: Copies, delays: Delays) -> None:
    """Gives each block with an unregistered multiplier its own copy of a register that other blocks read too."""
    cells, nets = copies.cells, copies.nets

    def is_operand(reader: tuple[str, str]) -> bool:
        name, port = reader
        cell = cells.get(name, {"type": ""})
        return cell["type"] == MULTIPLIER and port[0] in "AB" and "REG_INPUTA_CLK" not in cell["parameters"]

    for bit, name in sorted(nets.flip_flop.items()):
        model, readers = cells[name], sorted(nets.readers.get(bit, []))
        if model.get("attributes", {}).get("keep") or any(not cell for cell, _ in readers):
            continue
        if delays.arrival(model["connections"].get("DI", ["x"])[0]) > TO_Q:
            continue
        by_block: dict[str, list] = {}
        for reader in readers:
            by_block.setdefault(block_of(copies.register(reader[0])), []).append(reader)
        alone = [group for group in by_block.values() if any(map(is_operand, group))]
        for group in alone if len(alone) < len(by_block) else alone[1:]:
            copies.hand_over(bit, group)


def own_luts(copies: Copies, late: set[int]) -> None:
    """Gives each flip-flop that takes a late bit of a LUT one of its own."""
    for bit in sorted(late):
        if copies.cells[copies.nets.driver[bit]]["type"] in (LUT, *INSIDE):
            takers = [(cell, port) for cell, port in copies.nets.readers.get(bit, []) if cell and port == "DI"]
            for taker in takers[1:]:
                if copies.cells[taker[0]]["type"] == FLIP_FLOP:
                    copies.hand_over(bit, [taker])
