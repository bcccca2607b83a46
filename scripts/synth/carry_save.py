"""Adds three numbers in one carry chain of an ECP5 instead of two.

Where a product of two multipliers is added to something behind its register, a chain puts the parts together and a
second one adds: two chains and a net between two clocks, where a DSP48 adds both inside.  This pass edits the mapped
netlist (yosys' JSON): the first chain goes, and in front of each bit of the second stand two LUTs side by side,
        x = a xor b,   m = majority(a, b, c),   and the chain adds c + x and m from the bit below,
c what was added, a and b the parts.  A step of the chain takes x and c both, as its LUT has an input left.
Modulo the second chain's width both ways are the same sum; where that chain is longer than the first, whose top bit it
repeats as the sign, only as long as a + b fits the first: otherwise the pass leaves them as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product, takewhile

from scripts.synth.netlist import ADDER, BITS, CONSTANTS, Nets

PLAIN = {"INIT0": "1001011010101010", "INIT1": "1001011010101010", "INJECT1_0": "NO", "INJECT1_1": "NO"}
MULTIPLIER = "MULT18X18D"


@dataclass(frozen=True)
class Step:
    """One bit of a chain: half ``half`` of a cell."""

    cell: str
    half: int


class CarrySave:
    """A module whose chains are looked at one after the other; ``luts`` counts what was put in."""

    def __init__(self, module: dict):
        self.cells = module["cells"]
        self.nets = Nets(module)
        self.luts = 0

    def chains(self) -> Iterator[list[Step]]:
        """All chains whose carries only they read, each from its first carry to the last sum that is read."""
        for name, cell in list(self.cells.items()):
            if cell["type"] == ADDER and self._next(cell["connections"]["CIN"], self.nets.driver.get, "COUT") is None:
                chain = [name]
                while following := self._next(self.carry(chain[-1]), self._reader, "CIN"):
                    chain.append(following)
                steps = [Step(cell, half) for cell in chain for half in (0, 1)]
                while steps and not self._read(steps[-1]):
                    steps.pop()
                if sum(len(self.nets.readers.get(bit, [])) for cell in chain for bit in self.carry(cell)) < len(chain):
                    yield steps

    def carry(self, cell: str) -> list:
        """The bit at its COUT, in a list as it stands in the netlist."""
        return self.cells[cell]["connections"].get("COUT", [])

    def _reader(self, bit: int) -> str | None:
        return next((name for name, port in self.nets.readers.get(bit, []) if port == "CIN"), None)

    def _next(self, bits: list, find: Callable[[int], str | None], port: str) -> str | None:
        """The adder that ``find`` gives for the carry ``bits``, where ``port`` of that is the carry too."""
        name = find(bits[0]) if bits else None
        cell = self.cells.get(name, {"type": ""})
        return name if cell["type"] == ADDER and cell["connections"].get(port) == bits else None

    def pin(self, step: Step, side: str):
        """The bit at A, B, C or D, "0" for an open one; at S the bit or None."""
        bits = self.cells[step.cell]["connections"].get(f"{side}{step.half}", [])
        if side == "S":
            return bits[0] if bits else None
        return bits[0] if bits and bits[0] not in ("x", "z") else "0"

    def _read(self, step: Step) -> list[tuple[str, str]]:
        return self.nets.readers.get(self.pin(step, "S"), [])

    def _plain(self, steps: list[Step]) -> bool:
        """Whether each step adds A and B, or A and the complement of B."""
        return all(
            self.cells[step.cell]["parameters"] == PLAIN
            and self.pin(step, "D") == "1"
            and self.pin(step, "C") in ("0", "1")
            for step in steps
        )

    def spare(self, operand: list) -> int:
        """Bits by which a signed operand of a chain is longer than its values need; -1 where that is not known."""
        top = operand[-1]
        repeated = sum(1 for _ in takewhile(lambda bit: bit == top, reversed(operand)))
        maker = self.cells.get(self.nets.driver.get(top), {"type": ""})
        if maker["type"] != MULTIPLIER:
            return repeated - 1
        number = {maker["connections"].get(f"P{n}", [None])[0]: n for n in range(BITS["P"])}
        own = [number.get(bit) for bit in operand[: len(operand) - repeated + 1]]
        if None in own or own != list(range(own[0], own[0] + len(own))):
            return -1
        # |product| <= 2**(both widths - 2)
        return repeated - 1 + own[-1] - (self._width(maker, "A") + self._width(maker, "B") - 2)

    def _width(self, multiplier: dict, side: str) -> int:
        """Bits of a signed number that holds the operand's values."""
        nets = multiplier["connections"]
        signed = nets.get(f"SIGNED{side}", ["0"]) == ["1"]
        bits = [nets.get(f"{side}{n}", ["0"])[0] for n in range(BITS[side])] + ([] if signed else ["0"])
        return len(bits) + 1 - sum(1 for _ in takewhile(lambda bit: bit == bits[-1], reversed(bits)))

    def _where(self, first: list[Step], step_of: dict[tuple[str, str], tuple[list[Step], int]]):
        """(second chain, place of the first's lowest bit in it, side) where its sum goes nowhere else; else None."""
        places = [[step_of.get((name, port)) for name, port in self._read(step)] for step in first]
        if not all(places) or any(place is None for found in places for place in found):
            return None
        sides = {port[0] for step in first for _, port in self._read(step)}
        (second, low), rest = places[0][0], sorted(at for _, at in places[-1])
        ends = list(range(low + len(first) - 1, len(second)))  # the top bit: once at least, to the end where repeated
        if (
            len(sides) != 1
            or any(chain is not second for found in places for chain, _ in found)
            or any([at for _, at in found] != [low + n] for n, found in enumerate(places[:-1]))
            or rest != ends
        ):
            return None
        return second, low, sides.pop()

    def _lut(self, made: dict, value: Callable[..., int], *bits):
        """The bit that is ``value`` of these; a LUT, where it takes one."""
        inputs = sorted({bit for bit in bits if bit not in CONSTANTS})
        known = {"0": 0, "1": 1}
        table = [
            value(*((known | dict(zip(inputs, case, strict=True)))[bit] for bit in bits))
            for case in product((0, 1), repeat=len(inputs))
        ]
        if len(set(table)) == 1:
            return str(table[0])
        for bit in inputs:
            if table == [dict(zip(inputs, case, strict=True))[bit] for case in product((0, 1), repeat=len(inputs))]:
                return bit
        if (key := (tuple(inputs), tuple(table))) not in made:
            made[key] = self.nets.free
            self.nets.free += 1
        return made[key]

    def _put(self, made: dict, beside: str) -> None:
        """Puts the LUTs of ``made`` into the block that ``beside`` is of."""
        for n, ((inputs, table), bit) in enumerate(made.items()):
            pins = dict(zip("ABCD", inputs + ("0",) * (4 - len(inputs)), strict=True))
            # the first of the inputs counts most in the table, A least in the LUT
            index = [sum((k >> j & 1) << (len(inputs) - 1 - j) for j in range(len(inputs))) for k in range(16)]
            self.cells[f"{beside}_saved_{n}_LUT4"] = {
                "type": "LUT4",
                "parameters": {"INIT": "".join(str(table[index[k]]) for k in reversed(range(16)))},
                "attributes": {},
                "port_directions": dict.fromkeys("ABCD", "input") | {"Z": "output"},
                "connections": {pin: [at] for pin, at in pins.items()} | {"Z": [bit]},
            }
        self.luts += len(made)

    def save(self) -> int:
        """Makes one of every two chains that this is right for; how many went."""
        chains = [chain for chain in self.chains() if chain and self._plain(chain)]
        step_of = {
            (step.cell, f"{side}{step.half}"): (chain, n)
            for chain in chains
            for n, step in enumerate(chain)
            for side in "AB"
        }
        gone = 0
        for first in chains:
            found = self._where(first, step_of)
            carry = self.cells[first[0].cell]["connections"]["CIN"][0]
            if not found or carry != "0" or any(self.pin(step, "C") != "0" for step in first):
                continue
            second, low, side = found
            above = second[low:]
            if not self._plain(above) or (side == "B" and any(self.pin(step, "C") != "0" for step in above)):
                continue  # one that has three already, or the sum is taken away
            a, b = ([self.pin(step, side) for step in first] for side in "AB")
            spare = sorted([self.spare(a), self.spare(b)])
            if len(above) > len(first) and (spare[0] < 1 or sum(spare) < 3):
                continue
            self._merge(first, above, side, a, b)
            gone += 1
        return gone

    def _merge(self, first: list[Step], above: list[Step], side: str, a: list, b: list) -> None:
        made: dict = {}
        carried = "0"
        for n, step in enumerate(above):
            turned = int(self.pin(step, "C")) if side == "A" else 0
            c = self.pin(step, "B" if side == "A" else "A")
            parts = a[min(n, len(a) - 1)], b[min(n, len(b) - 1)]
            x = self._lut(made, lambda p, q, turned=turned: p ^ q ^ turned, *parts)
            pins = {"A": carried, "B": x, "C": c}
            self.cells[step.cell]["connections"].update({f"{pin}{step.half}": [bit] for pin, bit in pins.items()})
            if n + 1 < len(above):
                carried = self._lut(made, lambda p, q, r, turned=turned: int(p + q + (r ^ turned) > 1), *parts, c)
        for name in {step.cell for step in first}:
            del self.cells[name]
        self._put(made, above[0].cell)


def save_carries(netlist: dict, top: str) -> dict[str, int]:
    """Changes ``netlist`` in place; {"chains": that went, "luts": that came}."""
    work = CarrySave(netlist["modules"][top])
    return {"chains": work.save(), "luts": work.luts}
