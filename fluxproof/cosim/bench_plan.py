# SPDX-License-Identifier: BSD-3-Clause
"""Makes the file of a block's bench: its schedule (cosim/schedule.py) as rows for the simulator."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from fluxproof.cosim.bench_file import Bench, Row, save
from fluxproof.cosim.schedule import Clock, due, schedule
from fluxproof.cosim.stimulus import SHORT
from golden_model.block import Block


def eventful(block: Block, clocks: list[Clock]) -> list[int]:
    """The clocks at which something is driven or compared; between two of them no output is due.

    A block whose sample is the clock, or whose outputs must never move by themselves, is looked at in every clock.
    """
    if block.clocked or block.atomic:
        return list(range(len(clocks)))
    chosen = {0, 1, 2, 3, 4, len(clocks) - 1}
    for number, (before, clock) in enumerate(pairwise(clocks), 1):
        if clock.writes or clock.expected or (clock.rst, clock.in_valid) != (before.rst, before.in_valid):
            chosen.add(number)
        if clock.out_valid or clock.soon:
            # It rises and falls at these clocks and at no other.
            chosen |= {number - 1, number, min(number + 1, len(clocks) - 1)}
    return sorted(chosen)


def plan(block: Block, index: int, seed: int) -> Bench:
    """The bench of a block with its configuration number ``index``."""
    config = block.configs[index]
    clocks = schedule(block, config, seed, SHORT)
    rules = due(block, clocks)
    strobes = ("out_valid", "out_soon") if block.soon else ("out_valid",)
    rows = [
        Row(
            number,
            rules[number].strobes,
            tuple((name, int(value)) for name, value in rules[number].outputs),
            rules[number].still,
            rules[number].of_sample,
            {name: int(value) for name, value in clocks[number].writes.items()},
            clocks[number].in_valid,
            clocks[number].rst,
            clocks[number].sample,
            bool(clocks[number].expected),
        )
        for number in eventful(block, clocks)
    ]
    return Bench(
        f"{block.name} {dict(config)}",
        seed,
        f"FLUXPROOF_SEED={seed} make test ARGS='-k \"test_rtl and {block.name}-{index}\"'",
        tuple(p.name for p in block.ports(config)),
        tuple((p.name, bool(p.fmt.signed)) for p in block.out_ports(config)),
        strobes if block.strobes and not block.clocked else (),
        block.strobes,
        block.atomic,
        tuple(rows),
        len(clocks),
    )


def write(path: Path, block: Block, index: int, seed: int) -> Path:
    """Writes the bench of a block to ``path``."""
    return save(path, plan(block, index, seed))
