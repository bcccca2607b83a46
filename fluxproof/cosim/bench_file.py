# SPDX-License-Identifier: BSD-3-Clause
"""What the bench in the simulator has to do, as plain values in a file.

The simulator starts a Python of its own for each bench.  It imports this file and cocotb, and not the models, whose
compiler alone takes longer to load than most benches run: who starts the bench makes the rows (cosim/bench_plan.py).
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import NamedTuple

from fluxproof.files import write_bytes


class Row(NamedTuple):
    """A clock at which something is driven or compared: compared before its rising edge, driven for it."""

    number: int  # of the clock
    strobes: tuple[tuple[str, int], ...]  # out_valid, out_soon: what they must show
    outputs: tuple[tuple[str, int], ...]
    still: bool  # every output must be as it was in the clock before
    of_sample: int  # the sample that ``outputs`` belong to
    writes: dict[str, int]
    in_valid: int
    rst: int
    sample: int  # the one that enters here, -1: none
    due: bool  # a sample's outputs are due here


class Bench(NamedTuple):
    """One run: a block with a configuration and a seed."""

    title: str  # the block and its generics
    seed: int
    rerun: str  # the command that brings this run back
    inputs: tuple[str, ...]
    outputs: tuple[tuple[str, bool], ...]  # name, signed
    strobes: tuple[str, ...]  # out_valid, out_soon, where the block has them
    has_rst: bool
    atomic: bool
    rows: tuple[Row, ...]
    clocks: int  # in all


def save(path: Path, bench: Bench) -> Path:
    """Writes the bench; returns ``path``."""
    plain = bench._replace(rows=tuple(tuple(row) for row in bench.rows))
    return write_bytes(path, pickle.dumps(tuple(plain), protocol=pickle.HIGHEST_PROTOCOL))


def load(path: Path | str) -> Bench:
    """What ``save`` wrote."""
    bench = Bench(*pickle.loads(Path(path).read_bytes()))
    return bench._replace(rows=tuple(Row(*row) for row in bench.rows))
