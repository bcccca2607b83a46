"""Proves that a mutant's difference is forgotten: a bit is shifted out before it counts, a value is calculated again.

Such a difference is in the registers for some clocks, so an induction over one clock does not find it.  Here a set of
states is one word per register, or per pair of the two halves (graph.py): 0, 1, SAME (any, equal in both halves) or
APART (any two).  One clock of such a set is evaluated with an unknown for each input and each such word; gates with the
same operands are one, so halves that compute the same have the same literal.  Registers that the strobe and a reset
make constant are the control: sets whose control differs are kept apart, others are joined.  The sets grow until they
hold all that follows from them by a clock with a sample, without one, and in reset.  The flag must never rise.
"""

from __future__ import annotations

from pathlib import Path

from scripts.mutate.graph import Graph

ZERO, ONE, SAME, APART = range(4)
MOST_GATES = 16_000_000  # evaluated for a mutant: some seconds
ANY = None  # of an input: an unknown

States = tuple[int, ...]


class Samples:
    """The clocks of a strobed block, as the miter's graph holds them (contract.py)."""

    def __init__(self, graph: Graph, names: Path, interval: int):
        self.graph = graph
        gates = {gate for _, gate in graph.pairs}
        self.golds = [n for n in range(len(graph.next)) if n not in gates]  # one of a pair stands for both
        self.gate_of = dict(graph.pairs)
        place, inverted = {}, set()
        for line in names.read_text().splitlines():
            kind, number, rest = line.split(maxsplit=2)
            if kind == "invlatch":
                inverted.add(int(number))
            place[kind.removeprefix("inv"), rest] = int(number)
        self.rst, self.valid = (place["input", f"0 any_{name}"] + 1 for name in ("rst", "in_valid"))
        known = {}  # at the first clock, which is in reset; the first sample may come at any time
        for name, value in (("since", interval), ("clocks", 0), ("legal", 1)):
            for bit in range(8):
                number = place.get(("latch", f"{bit} {name}"))
                if number is not None:
                    known[number] = (value >> bit & 1) ^ (number in inverted)
        self.since = {n: v for n, v in known.items() if any(place.get(("latch", f"{b} since")) == n for b in range(8))}
        self.start = tuple(known.get(n, SAME) for n in self.golds)
        self.at = {n: k for k, n in enumerate(self.golds)}
        self.interval = interval

    def forgets(self, number: int) -> bool:
        """Whether no sequence of samples shows the mutant ``number``, as far as some effort tells."""
        chosen = self.graph.chosen
        self.constants = dict.fromkeys(chosen["gold"], 0)
        self.constants |= {node: number >> bit & 1 for bit, node in enumerate(chosen["gate"])}
        self.left = MOST_GATES
        first = self._clock(self.start, ANY, 1)
        if first is None:
            return False
        control = self._control(first)
        if control is None:
            return False
        found: dict[tuple, States] = {}
        wait = [first]
        while wait:
            states = wait.pop()
            key = tuple(states[k] for k in control)
            old = found.get(key)
            if old is not None:
                states = joined(old, states)
                if states == old:
                    continue
            found[key] = states
            ready = all(states[self.at[n]] == v for n, v in self.since.items())
            for valid, rst in ((0, 0), (1, 0), (ANY, 1))[: 3 if ready else 2]:
                if valid == 1 and not ready:
                    valid, rst = ANY, 1
                after = self._clock(states, valid, rst)
                if after is None:
                    return False
                wait.append(after)
        return True

    def _control(self, states: States) -> list[int] | None:
        """Places of the registers that are constant from a sample on until the next may come."""
        control = None
        for clock in range(self.interval + 1):
            states = self._clock(states, int(clock == 0), 0)
            if states is None:
                return None
            constant = {k for k, kind in enumerate(states) if kind < SAME}
            control = constant if control is None else control & constant
        return sorted(control)

    def _clock(self, states: States, valid: int | None, rst: int) -> States | None:
        """The states one clock later; None where the flag may rise, or where the effort is spent."""
        graph = self.graph
        self.left -= len(graph.a)
        if self.left < 0:
            return None
        value, unknown = [0] * (graph.top + 1), 2
        for node in range(1, graph.first):
            value[node], unknown = unknown, unknown + 2
        for node, constant in self.constants.items():
            value[node] = constant
        value[self.rst] = rst
        if valid is not ANY:
            value[self.valid] = valid
        for gold, kind in zip(self.golds, states, strict=True):
            value[graph.first + gold], unknown = (kind, unknown) if kind < SAME else (unknown, unknown + 2)
            gate = self.gate_of.get(gold)
            if gate is not None:
                value[graph.first + gate] = value[graph.first + gold]
                if kind == APART:
                    value[graph.first + gate], unknown = unknown, unknown + 2
        made: dict[tuple[int, int], int] = {}
        for node, x, y in zip(range(graph.gates, graph.top + 1), graph.a, graph.b, strict=True):
            a, b = value[x >> 1] ^ (x & 1), value[y >> 1] ^ (y & 1)
            if a < b:
                a, b = b, a
            if b == 0 or a == b ^ 1:
                continue
            if b == 1 or a == b:
                value[node] = a
                continue
            literal = made.get((a, b))
            if literal is None:
                literal = made[a, b] = unknown
                unknown += 2
            value[node] = literal
        if value[graph.flag >> 1] ^ (graph.flag & 1):
            return None
        following = [value[n >> 1] ^ (n & 1) for n in graph.next]
        found = []
        for gold in self.golds:
            a = following[gold]
            apart = gold in self.gate_of and a != following[self.gate_of[gold]]
            found.append(APART if apart else a if a < SAME else SAME)
        return tuple(found)


def joined(a: States, b: States) -> States:
    """The least set that holds both."""
    return tuple(x if x == y else max(x, y, SAME) for x, y in zip(a, b, strict=True))
