# SPDX-License-Identifier: BSD-3-Clause
"""Proves a mutant equivalent by what may differ in which clock of a sample, for blocks with strobes.

A phase is the state of the contract's own counters (scripts/mutate/contract.py): the clocks since the last sample, and
of what is in flight.  A register that is shifted out, or calculated again, before anything reads it differs in some
phases only, which no induction over a single clock knows.  Here each phase has its own

1. constants: registers with one value whenever the phase comes, found by simulation with the values 0, 1 and unknown;
2. pairs: registers that are the same in the block and in the mutant; all of them at first, then those are left out
   that neither the clock before nor the two clocks before make equal, until nothing changes.

If no flag can rise then, the mutant is equivalent.  Registers start with any value, the same in both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from pathlib import Path

import numpy as np

from scripts.mutate.graph import Cut, Graph

CONTROL = ("clocks", "since", "age", "left", "legal")  # registers of the contract that make a phase
SWITCHES = ("any_rst", "any_in_valid")
WORDS = (1 << 64) - 1  # random values of every input at once
MOST = 600  # phases; more are not tried

Phase = tuple[int, ...]
Move = tuple[Phase, tuple[int, ...]]  # a phase and the values of the switches in it
Moves = dict[Move, Phase]  # the phase that follows
FLAG = -1  # beside the numbers of registers


class Late(Exception):
    """The time is over, or the flag rises."""


class Phases:
    """The phases of a graph, and the proof for one mutant after the other."""

    def __init__(self, graph: Graph, names: Path):
        self.graph, self.rng = graph, np.random.default_rng(1)
        control, switches = [], {}
        for line in names.read_text().splitlines():
            kind, number, bit, name = line.split(maxsplit=3)
            if kind.endswith("latch") and name in CONTROL:
                control.append(int(number))
            elif kind == "input" and name in SWITCHES:
                switches[name] = int(number) + 1
        self.control, self.switches = sorted(set(control)), list(switches.values())
        self.combos = [tuple(k >> bit & 1 for bit in range(len(switches))) for k in range(1 << len(switches))]
        self.pair_of = {gate: gold for gold, gate in graph.pairs}

    def equivalent(self, number: int, never: Callable[[Cut], bool], seconds: float) -> bool:
        """Whether the mutant is proved within so many seconds; ``never``: whether a flag alone cannot rise."""
        self.number, self.never, self.until = number, never, time.process_time() + seconds
        try:
            constants, moves = self._simulated()
            return self._proved(constants, moves)
        except Late:
            return False

    def _fixed(self) -> dict[int, int]:
        """The inputs that choose the mutant."""
        gate = self.graph.chosen["gate"]
        return dict.fromkeys(self.graph.chosen["gold"], 0) | {n: self.number >> bit & 1 for bit, n in enumerate(gate)}

    def _in_time(self) -> None:
        if time.process_time() > self.until:
            raise Late

    def _simulated(self) -> tuple[dict[Phase, np.ndarray], Moves]:
        """Phase -> for each register whether it can be 1 and whether it can be 0; how phases follow one another."""
        first = (0,) * len(self.control)
        can = {first: np.ones((2, len(self.graph.next)), bool)}
        moves: Moves = {}
        changed = [first]
        while changed:
            self._in_time()
            lanes = [(phase, combo) for phase in changed for combo in self.combos]
            following = self._ternary(can, lanes)
            changed = []
            for (phase, combo), after in zip(lanes, following, strict=True):
                if (after[0, self.control] & after[1, self.control]).any():
                    raise Late  # the contract depends on what it does not know
                target = tuple(int(bit) for bit in after[0, self.control])
                moves[phase, combo] = target
                old = can.get(target)
                new = after if old is None else old | after
                if old is None or (new != old).any():
                    can[target] = new
                    changed.append(target)
            changed = list(dict.fromkeys(changed))
            if len(can) > MOST:
                raise Late
        return can, moves

    def _ternary(self, can: dict[Phase, np.ndarray], lanes: list[tuple[Phase, tuple[int, ...]]]) -> np.ndarray:
        """The registers after one clock, for each pair of phase and switches: [lane, can be 1 or 0, register]."""
        g = self.graph
        one, zero = (np.ones((g.top + 1, len(lanes)), bool) for _ in range(2))
        one[0] = False
        for node, bit in self._fixed().items():
            one[node], zero[node] = bit, not bit
        for place, node in enumerate(self.switches):
            one[node] = [combo[place] for _, combo in lanes]
            zero[node] = ~one[node]
        for k, (phase, _) in enumerate(lanes):
            registers = can[phase].copy()
            registers[0, self.control] = phase
            registers[1, self.control] = ~registers[0, self.control]
            one[g.first : g.gates, k], zero[g.first : g.gates, k] = registers
        sides = (one, zero)
        for k, (a, b) in enumerate(zip(g.a, g.b, strict=True), g.gates):
            one[k] = sides[a & 1][a >> 1] & sides[b & 1][b >> 1]
            zero[k] = sides[~a & 1][a >> 1] | sides[~b & 1][b >> 1]
        after = [[sides[(literal ^ side) & 1][literal >> 1] for literal in g.next] for side in (0, 1)]
        return np.array(after).transpose(2, 0, 1)

    def _proved(self, can: dict[Phase, np.ndarray], moves: Moves) -> bool:
        """Leaves out pairs until those of each phase follow from those before it; whether no flag rises."""
        same = {phase: set(self.pair_of) for phase in can}
        into: dict[Phase, list[Move]] = {phase: [] for phase in can}
        for move, target in moves.items():
            into[target].append(move)
        todo = list(moves)
        while todo:
            smaller = set()
            for move in todo:
                wanted = same[moves[move]] | {FLAG}
                wrong = self._wrong([move], can, same, wanted)
                if wrong and into[move[0]]:  # a phase that nothing leads to is the first
                    wrong = set().union(*(self._wrong([before, move], can, same, wrong) for before in into[move[0]]))
                if FLAG in wrong:
                    raise Late
                if wrong:
                    same[moves[move]] -= wrong
                    smaller.add(moves[move])
            after = {moves[move] for move in moves if move[0] in smaller}
            todo = [move for move in moves if move[0] in smaller | after]
        return True

    def _wrong(self, path: list[Move], can: dict, same: dict, wanted: Collection[int]) -> set[int]:
        """Of the ``wanted`` pairs, those that these clocks do not make equal; the flag where it rises in the last."""
        self._in_time()
        g, registers, words = self.graph, None, None
        g.forget()
        for phase, combo in path:
            value, words = self._frame(phase, combo, can[phase], same[phase], registers, words)
            registers = [value[literal >> 1] ^ (literal & 1) for literal in g.next]

        def differ(a: int, b: int) -> bool:
            """Whether two literals of the last clock do."""
            if self._word(words, a) != self._word(words, b):
                return True
            a, b = (value[literal >> 1] ^ (literal & 1) for literal in (a, b))
            return a != b and (flag := g.differ(a, b)) != 0 and not self.never(g.cut(flag))

        wrong = set()
        for pair in wanted:
            ends = (g.flag, 0) if pair == FLAG else (g.next[self.pair_of[pair]], g.next[pair])
            if differ(*ends):
                wrong.add(pair)
        return wrong

    @staticmethod
    def _word(words: list[int], literal: int) -> int:
        return words[literal >> 1] ^ (WORDS if literal & 1 else 0)

    def _frame(
        self,
        phase: Phase,
        combo: tuple[int, ...],
        can: np.ndarray,
        same: Collection[int],
        registers: list[int] | None,
        before: list[int] | None,
    ) -> tuple[list[int], list[int]]:
        """The literal of each node in this phase, and 64 random values of it.

        registers, before: what the clock before has given, literals and the values of all its nodes; none: any.
        """
        g = self.graph
        value = [2 * node for node in range(g.gates)] + [0] * len(g.a)
        words = [int(w) for w in self.rng.integers(0, 1 << 64, g.gates, np.uint64)] + [0] * len(g.a)
        if registers:
            for node in range(1, g.first):  # inputs of their own
                value[node] = 2 * len(g.made_of)
                g.made_of.append(None)
            value[g.first : g.gates] = registers
            words[g.first : g.gates] = [self._word(before, literal) for literal in g.next]
        constants = self._fixed() | dict(zip(self.switches, combo, strict=True))
        constants |= {g.first + c: bit for c, bit in zip(self.control, phase, strict=True)} | {0: 0}
        known = np.flatnonzero(can[0] ^ can[1])
        constants |= {g.first + int(r): int(can[0, r]) for r in known if g.first + int(r) not in constants}
        for node, bit in constants.items():
            value[node], words[node] = bit, WORDS * bit
        for gate in same:
            value[g.first + gate] = value[g.first + self.pair_of[gate]]
            words[g.first + gate] = words[g.first + self.pair_of[gate]]
        for k, (a, b) in enumerate(zip(g.a, g.b, strict=True)):
            value[g.gates + k] = g.both_of(value[a >> 1] ^ (a & 1), value[b >> 1] ^ (b & 1))
            left, right = words[a >> 1] ^ (WORDS * (a & 1)), words[b >> 1] ^ (WORDS * (b & 1))
            words[g.gates + k] = left & right
        return value, words
