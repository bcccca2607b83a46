# SPDX-License-Identifier: BSD-3-Clause
"""Runs mutants in Verilator against the schedule of a bench: one library for all mutations of a netlist."""

from __future__ import annotations

import ctypes
from array import array
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fluxproof.cosim.schedule import due, schedule
from fluxproof.cosim.verilator import LIBRARY, compile_library
from fluxproof.cosim.verilog import VerilogPort
from golden_model.block import Block
from scripts.mutate.draw import TOP, Drawn, mutated

WRAPPER = Path(__file__).with_name("judge.cpp")
# Most mutants live for some hundred clocks: a quick build is worth more than a quick run.
HOT = "-O1"
OPTIONS = ("--x-initial", "unique")  # registers without a reset start with the bits of a seed
BENCH_SEED = 1  # of the schedule, as the tests have it
IN_RESET = 2  # clocks of reset that the benches in GHDL make before the schedule's own
_LONG, _INT = ctypes.c_int64, ctypes.c_int
_LONGS = np.ctypeslib.ndpointer(np.int64, flags="C_CONTIGUOUS")


@dataclass(frozen=True)
class Trial:
    """A schedule as arrays of int64: rows are (clock, port, value), ports are numbers in the order of ``ports``."""

    ports: tuple[VerilogPort, ...]
    before: int  # clocks before the first, with the values that ``writes`` has for clock -before
    clocks: int
    writes: np.ndarray
    checks: np.ndarray
    still: np.ndarray  # clocks at which the ports of ``kept`` must not have moved
    kept: np.ndarray


def block_ports(block: Block, config) -> tuple[VerilogPort, ...]:
    """The ports of a block: those declared, and those of the contract."""
    strobes = block.strobes and not block.clocked
    bits = [("clk", True)] + [("rst", True)] * block.strobes
    bits += [("in_valid", True), ("out_valid", False)] * strobes + [("out_soon", False)] * bool(block.soon)
    own = [VerilogPort(name, 1, False, is_input) for name, is_input in bits]
    for ports, is_input in ((block.ports(config), True), (block.out_ports(config), False)):
        own += [VerilogPort(p.name, p.fmt.width, bool(p.fmt.signed), is_input) for p in ports]
    return tuple(own)


def block_trial(block: Block, config, seed: int) -> Trial:
    """What fluxproof/cosim/block_bench.py drives and compares, clock by clock."""
    ports = block_ports(block, config)
    number = {p.name: k for k, p in enumerate(ports)}
    clocks = schedule(block, config, seed)
    # Flat lists of numbers, three to a row: a long schedule has millions of them.
    writes, checks, still = array("q", [-IN_RESET, number["rst"], 1] if block.strobes else []), array("q"), []
    held: dict[str, int] = {}
    for at, (clock, rule) in enumerate(zip(clocks, due(block, clocks), strict=True)):
        driven = dict(clock.writes)
        # A clocked block may have an input of its own that is called in_valid.
        driven |= {"rst": clock.rst} if block.strobes else {}
        driven |= {"in_valid": clock.in_valid} if block.strobes and not block.clocked else {}
        for name, value in driven.items():
            if held.get(name) != value:
                writes.extend((at, number[name], value))
        held |= driven
        for name, value in (*rule.strobes, *rule.outputs):
            checks.extend((at, number[name], value))
        still += [at] * rule.still
    kept = [number[p.name] for p in block.out_ports(config)]
    return Trial(
        ports,
        IN_RESET,
        len(clocks),
        np.frombuffer(writes, np.int64).reshape(-1, 3),
        np.frombuffer(checks, np.int64).reshape(-1, 3),
        np.array(still, np.int64),
        np.array(kept, np.int64),
    )


def build(drawn: Drawn, ports: tuple[VerilogPort, ...]) -> Path:
    """The library with all mutations of ``drawn``, compiled in its folder."""
    (drawn.folder / f"{TOP}.v").write_text(mutated(drawn))
    compile_library(drawn.folder, TOP, ports, WRAPPER, HOT, OPTIONS)
    return drawn.folder / LIBRARY


class Bench:
    """All mutants of a netlist, each judged by one trial."""

    def __init__(self, library: Path, trial: Trial, seed: int):
        self.trial, self.seed = trial, seed
        self._judge = ctypes.CDLL(str(library)).judge
        self._judge.restype = _LONG
        table = [_LONGS, _LONG]
        self._judge.argtypes = [_LONG, _INT, _LONG, _LONG, *table, *table, *table, *table]

    def first_difference(self, mutant: int) -> int | None:
        """The clock at which mutant number ``mutant`` is noticed; 0 is the netlist without a mutation."""
        t = self.trial
        arrays = [x for table in (t.writes, t.checks, t.still, t.kept) for x in (table, len(table))]
        found = self._judge(mutant, self.seed, t.before, t.clocks, *arrays)
        return None if found == -1 else found
