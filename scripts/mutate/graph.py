# SPDX-License-Identifier: BSD-3-Clause
"""An and-inverter graph that holds a block twice, and what of it can matter for one mutant.

Both halves have their registers in pairs.  As long as all pairs are equal, the mutant behaves like the block: it is
enough that one clock never makes a pair different, nor raises the flag (`Graph.step`).  Where that does not hold, the
pairs that can differ are told apart from those that never do, by comparing structure alone (`Graph.both`).  A literal
is twice the number of its node, plus 1 where it is inverted; 0 is false.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class Cut:
    """What is left: inputs and registers are the literals 2, 4, ... in this order, then the gates."""

    inputs: int
    latches: list[int]  # the literal that each becomes
    ands: list[tuple[int, int]]
    flag: int

    @property
    def top(self) -> int:
        """The last node."""
        return self.inputs + len(self.latches) + len(self.ands)

    def write(self, path: Path) -> None:
        """In AIGER's binary form; every register starts at 0."""
        first = self.inputs + len(self.latches) + 1
        text = f"aig {self.top} {self.inputs} {len(self.latches)} 1 {len(self.ands)}\n"
        text += "".join(f"{literal}\n" for literal in (*self.latches, self.flag))
        body = bytearray(text.encode())
        for number, (a, b) in enumerate(self.ands, first):
            for delta in (2 * number - a, a - b):
                while delta >= 128:
                    body.append(delta & 127 | 128)
                    delta >>= 7
                body.append(delta)
        path.write_bytes(body)

    def clauses(self) -> list[tuple[int, ...]]:
        """That the flag is high, in conjunctive normal form; a variable is a node, plus 1."""
        first = self.inputs + len(self.latches) + 1

        def of(literal: int) -> int:
            return -(literal // 2 + 1) if literal & 1 else literal // 2 + 1

        found = [(-1,), (of(self.flag),)]
        for node, (a, b) in enumerate(self.ands, first):
            y = node + 1
            found += [(-y, of(a)), (-y, of(b)), (y, -of(a), -of(b))]
        return found


class Graph:
    """The two halves, `gold.` and `gate.` by the names of their registers, with the inputs that choose the mutant."""

    def __init__(self, path: Path, names: Path):
        data = path.read_bytes()
        head, at = _line(data, 0)
        self.top, self.inputs, latches, _, count = (int(word) for word in head.split()[1:6])
        self.next = []
        for _ in range(latches):
            line, at = _line(data, at)
            self.next.append(int(line.split()[0]))
        line, at = _line(data, at)
        self.flag = int(line)
        self.first = self.inputs + 1  # node of the first register
        self.gates = self.first + latches  # node of the first gate
        self.a, self.b = [], []
        for node in range(self.gates, self.gates + count):
            less, at = _delta(data, at)
            lesser, at = _delta(data, at)
            self.a.append(2 * node - less)
            self.b.append(2 * node - less - lesser)
        self.pairs, self.chosen = _named(names)
        self._new()
        while found := self._unnamed():
            self.pairs += found
            self._new()
        self._readers()

    def _unnamed(self) -> list[tuple[int, int]]:
        """Registers without a name that stand in both halves at the same place: each is the next value of a pair."""
        paired = {register for pair in self.pairs for register in pair}
        found = []
        for k in self.apart(self.value):
            gold, gate = (self._of(self.next[register], self.value) for register in self.pairs[k])
            registers = gold // 2 - self.first, gate // 2 - self.first
            if gold % 2 == gate % 2 and all(0 <= r < len(self.next) and r not in paired for r in registers):
                found.append(registers)
                paired.update(registers)
        return found

    def _readers(self) -> None:
        """For each node its readers among the gates."""
        self.read_by: list[list[int]] = [[] for _ in range(self.top + 1)]
        for k in range(len(self.a)):
            self.read_by[self.a[k] >> 1].append(self.gates + k)
            if self.b[k] >> 1 != self.a[k] >> 1:
                self.read_by[self.b[k] >> 1].append(self.gates + k)

    def _new(self) -> None:
        """The same graph without a mutant, in which every pair of registers is one."""
        self.made: dict[tuple[int, int], int] = {}
        self.made_of: list[tuple[int, int] | None] = [None] * self.gates
        self.value = [2 * node for node in range(self.gates)] + [0] * len(self.a)
        for node in self.chosen["gold"] + self.chosen["gate"]:
            self.value[node] = 0
        for gold, gate in self.pairs:
            self.value[self.first + gate] = 2 * (self.first + gold)
        for k in range(len(self.a)):
            self.value[self.gates + k] = self._gate(k, self.value)

    def _of(self, literal: int, value: list[int]) -> int:
        return value[literal >> 1] ^ (literal & 1)

    def _gate(self, k: int, value: list[int]) -> int:
        a, b = self.a[k], self.b[k]
        return self.both_of(value[a >> 1] ^ (a & 1), value[b >> 1] ^ (b & 1))

    def both_of(self, a: int, b: int) -> int:
        """The literal of a and b; the same for the same two."""
        if a < b:
            a, b = b, a
        if b == 0 or a == b ^ 1:
            return 0
        if b in (1, a):
            return a
        found = self.made.get((a, b))
        if found is None:
            found = self.made[a, b] = 2 * len(self.made_of)
            self.made_of.append((a, b))
        return found

    def either(self, literals: Sequence[int]) -> int:
        """The literal of their or."""
        found = 0
        for literal in literals:
            found = self.both_of(found ^ 1, literal ^ 1) ^ 1
        return found

    def forget(self) -> None:
        """Drops all gates that were made, and with them what `mutant` gives."""
        self.made, self.made_of = {}, [None] * self.gates

    def differ(self, a: int, b: int) -> int:
        return self.either([self.both_of(a, b ^ 1), self.both_of(a ^ 1, b)])

    def _again(self, value: list[int], changed: dict[int, int]) -> None:
        """Gives nodes other values and the gates that follow from them."""
        wait = np.zeros(self.top + 1, bool)
        for node, literal in changed.items():
            if value[node] != literal:
                value[node] = literal
                wait[self.read_by[node]] = True
        at = self.gates
        while at <= self.top:
            at += int(wait[at:].argmax())
            if not wait[at]:
                return
            now = self._gate(at - self.gates, value)
            if now != value[at]:
                value[at] = now
                wait[self.read_by[at]] = True
            at += 1

    def mutant(self, number: int) -> list[int]:
        """The value of each node for this mutant, all pairs being equal."""
        value = list(self.value)
        self._again(value, {node: number >> bit & 1 for bit, node in enumerate(self.chosen["gate"])})
        return value

    def apart(self, value: list[int]) -> list[int]:
        """Pairs whose next values differ in structure; those that are one."""
        found = []
        for k, (gold, gate) in enumerate(self.pairs):
            merged = value[self.first + gate] == 2 * (self.first + gold)
            if merged and self._of(self.next[gold], value) != self._of(self.next[gate], value):
                found.append(k)
        return found

    def step(self, value: list[int], free: bool) -> Cut:
        """The flag: one clock makes a pair different that was equal, or raises the miter's flag.

        free: registers may have any value; else they are those of the block alone.
        """
        bad = [self._of(self.flag, value)]
        for k in self.apart(value):
            gold, gate = self.pairs[k]
            bad.append(self.differ(self._of(self.next[gold], value), self._of(self.next[gate], value)))
        return self._cut(value, self.either(bad), free)

    def both(self, value: list[int]) -> Cut:
        """The block and the mutant, with two registers for each pair that can differ."""
        value = list(value)
        while found := self.apart(value):
            own = (self.first + self.pairs[k][1] for k in found)
            self._again(value, {node: 2 * node for node in own})
        return self._cut(value, self._of(self.flag, value), free=False)

    def cut(self, flag: int) -> Cut:
        """What the flag depends on, with any values in the registers."""
        return self._cut([], flag, free=True)

    def _cut(self, value: list[int], flag: int, free: bool) -> Cut:
        """What the flag depends on."""
        need, todo = set(), [flag >> 1]
        while todo:
            node = todo.pop()
            if node in need or node == 0:
                continue
            need.add(node)
            if made := self.made_of[node]:
                todo += [made[0] >> 1, made[1] >> 1]
            elif node >= self.first and not free:
                todo.append(self._of(self.next[node - self.first], value) >> 1)
        ends = sorted(node for node in need if self.made_of[node] is None)
        inputs = [node for node in ends if free or node < self.first]
        latches = ends[len(inputs) :]
        gates = sorted(node for node in need if self.made_of[node])
        number = {node: k for k, node in enumerate([0, *inputs, *latches, *gates])}

        def renamed(literal: int) -> int:
            return 2 * number[literal >> 1] + (literal & 1)

        ands = [tuple(sorted(map(renamed, self.made_of[node]), reverse=True)) for node in gates]
        following = [renamed(self._of(self.next[node - self.first], value)) for node in latches]
        return Cut(len(inputs), following, ands, renamed(flag))


def _line(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(b"\n", at)
    return data[at:end].decode(), end + 1


def _delta(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while data[at] & 128:
        value |= (data[at] & 127) << shift
        shift, at = shift + 7, at + 1
    return value | data[at] << shift, at + 1


def _named(path: Path) -> tuple[list[tuple[int, int]], dict[str, list[int]]]:
    """Pairs of registers with the same name in both halves; the nodes of the inputs that choose the mutant, by bit."""
    gold: dict[str, int] = {}
    gate: dict[str, int] = {}
    chosen: dict[str, dict[int, int]] = {"gold": {}, "gate": {}}
    for line in path.read_text().splitlines():
        kind, number, rest = line.split(maxsplit=2)
        half, _, name = rest.partition(".")[0].partition("_") if kind == "input" else ("", "", "")
        bit, label = rest.split(maxsplit=1)
        if kind == "input" and label.startswith("mutant_"):
            chosen[label.removeprefix("mutant_")][int(bit)] = int(number) + 1
        elif kind.endswith("latch"):
            side, _, name = label.partition(".")
            if side in ("gold", "gate"):
                (gold if side == "gold" else gate)[f"{kind} {bit} {name}"] = int(number)
    found, taken = {}, set()
    for name, of_gate in gate.items():
        of_gold = gold.get(name)
        if of_gold is not None and of_gold != of_gate and of_gate not in found and of_gold not in taken:
            found[of_gate] = of_gold
            taken.add(of_gold)
    ordered = {half: [nodes.get(bit, 0) for bit in range(max(nodes, default=-1) + 1)] for half, nodes in chosen.items()}
    return [(of_gold, of_gate) for of_gate, of_gold in found.items()], ordered
