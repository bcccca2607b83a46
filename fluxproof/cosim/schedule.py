# SPDX-License-Identifier: BSD-3-Clause
"""When the bench drives and compares what: the samples of a block (cosim/stimulus.py) clock by clock.

Samples come back to back and with gaps; inputs are noise before and after the contract wants them; resets come in
mid-stream, with samples in flight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fluxproof.cosim.stimulus import LONG, Length, Sample, Samples, samples
from fluxproof.cosim.values import random_value
from golden_model.block import Block, Port

SETTLED = 2  # strobes are compared after this clock


NOTHING: Mapping[str, int] = {}


class Due(NamedTuple):
    """What a bench compares before a clock's rising edge; the inputs are still those of the clock before."""

    strobes: tuple[tuple[str, int], ...]  # out_valid, out_soon
    outputs: tuple[tuple[str, int], ...]
    still: bool  # every output is as it was before the edge of the clock before
    of_sample: int


@dataclass(slots=True)
class Clock:
    """One clock: what is driven before its rising edge, and what must be seen before the next one."""

    writes: dict[str, int]
    in_valid: int = 0
    rst: int = 0
    sample: int = -1  # index of the sample that enters here
    out_valid: int = 0
    of_sample: int = -1  # index of the sample whose outputs are due here
    expected: Mapping[str, int] = field(default_factory=lambda: NOTHING)
    soon: Mapping[str, int] = field(default_factory=lambda: NOTHING)  # outputs due with out_soon


def following(draw: Samples, state) -> Sample | None:
    """The next sample after this state; None at the end."""
    try:
        return draw.send(state)
    except StopIteration:
        return None


def schedule(block: Block, config: Mapping[str, int], seed: int, length: Length = LONG) -> list[Clock]:
    """Clock by clock, with what the model says must come out and when."""
    if block.clocked:
        return _clocked_schedule(block, config, seed, length)
    rng = np.random.default_rng(seed + 1)
    noise_ports = tuple(p for p in block.ports(config) if p.name in {q.name for q in block.inputs})
    clocks: list[Clock] = [Clock({}, rst=1), Clock({}, rst=1)]
    state, registers, last, resets = block.state, None, -(10**9), 0
    run = block.runner(config)

    def pad_to(index: int) -> None:
        """Idle clocks; the inputs become noise once the last sample no longer needs them."""
        while len(clocks) < index:
            writes = {}
            if len(clocks) == last + block.interval:
                writes = {p.name: random_value(rng, p) for p in noise_ports}
            clocks.append(Clock(writes))

    due: list[tuple[int, int, dict[str, int]]] = []
    soon: list[tuple[int, int, dict[str, int]]] = []
    late = [p for p in noise_ports if p.late]
    arrivals: list[tuple[int, Port, int, int]] = []
    draw, index = samples(block, config, seed, length), -1
    sample = next(draw)
    while sample is not None:
        row, index = sample.row, index + 1
        wanted_registers = {p.name: row[p.name] for p in block.registers}
        start = max(len(clocks), last + block.interval)
        if wanted_registers != registers:
            start = max(start, last + block.latency + 1)
        elif rng.integers(4) == 0:
            start += int(rng.integers(1, 2 * block.latency))
        if index and block.strobes and sample.resets and rng.integers(sample.resets) == 0:
            # A reset somewhere behind the last sample, in each clock in turn: what is in flight must never come out.
            pad_to(max(len(clocks), last + 1 + resets % (block.latency + 1)))
            resets += 1
            # Half the time with a sample on the same edge, which must be lost.
            clocks.append(Clock(dict(row), in_valid=int(rng.integers(2)), rst=1))
            registers = wanted_registers
            due = [d for d in due if d[0] < len(clocks)]
            soon = [d for d in soon if d[0] < len(clocks)]
            state = block.state
        pad_to(max(len(clocks), start))
        last = len(clocks)
        clocks.append(Clock(dict(row), in_valid=1, sample=index))
        registers = wanted_registers
        state, outputs = run(state, row)
        due.append((last + block.latency, index, outputs))
        if block.soon:
            soon.append((last + block.latency - block.ahead, index, {name: outputs[name] for name in block.soon}))
        arrivals += [(last, p, row[p.name], random_value(rng, p)) for p in late]
        sample = following(draw, state)
    pad_to(len(clocks) + 2 * block.latency + 2)
    for start, port, value, noise in arrivals:
        clocks[start].writes[port.name] = noise
        clocks[start + port.late].writes[port.name] = value
    for when, index, outputs in soon:
        clocks[when].of_sample, clocks[when].soon = index, outputs
    for when, index, outputs in due:
        clocks[when].out_valid, clocks[when].of_sample, clocks[when].expected = 1, index, outputs
    return clocks


def due(block: Block, clocks: list[Clock]) -> list[Due]:
    """The one rule of what is compared when, for every bench: an entry for each clock of the schedule.

    Strobes are compared from the fourth clock on, in every one of them: the reset has two clocks to work.  Outputs are
    compared with ``out_valid``, and again before the next sample or a reset if nothing was in flight: they must stay.
    """
    strobed = block.strobes and not block.clocked
    entries, last, left = [], -1, NOTHING
    after_reset = True  # before the first clock nothing was seen, and a reset may leave anything behind
    for number, clock in enumerate(clocks):
        strobes, outputs = (), []
        if strobed and number > SETTLED:
            strobes = (("out_valid", clock.out_valid),)
            if block.soon:
                strobes += (("out_soon", int(bool(clock.soon))),)
                outputs += clock.soon.items()
        still = block.atomic and not clock.out_valid and not after_reset
        if strobed and clock.out_valid and clock.of_sample == last:
            left = clock.expected
        elif left and (clock.in_valid or clock.rst):
            outputs += left.items()
        if clock.in_valid or clock.rst:
            last, left = clock.sample, NOTHING
        if clock.expected:
            outputs += _shown(block, clock.expected) if block.shown_with else clock.expected.items()
        entries.append(Due(strobes, tuple(outputs), still, clock.of_sample))
        after_reset = bool(clock.rst)
    return entries


def _shown(block: Block, expected: Mapping[str, int]) -> list[tuple[str, int]]:
    """The outputs that mean something now: some do only beside another one that is set."""
    return [(name, value) for name, value in expected.items() if expected.get(block.shown_with.get(name, ""), 1)]


def _clocked_schedule(block: Block, config: Mapping[str, int], seed: int, length: Length) -> list[Clock]:
    """For a block whose sample is the clock.

    Outputs are due before the edge that follows the sample's; in reset they are zero but for ``after_reset``.
    """
    rng, draw = np.random.default_rng(seed + 1), samples(block, config, seed, length)
    clocks, state = [Clock({}, rst=1), Clock({}, rst=1)], block.state
    at_rest = {p.name: 0 for p in block.outputs} | dict(block.after_reset)
    outputs, index, sample, run = at_rest, -1, next(draw), block.runner(config)
    while sample is not None:
        reset = int(sample.resets > 0 and rng.integers(sample.resets) == 0)
        row = dict(sample.row)
        if reset and rng.integers(2):  # what a register takes from an input must not get through a reset
            row |= {p.name: random_value(rng, p) for p in block.ports(config)}
        clocks.append(Clock(row, rst=reset, sample=index + 1, of_sample=index, expected=outputs))
        if reset:
            state, outputs = block.state, at_rest
        else:
            state, outputs = run(state, sample.row)
        index, sample = index + 1, following(draw, state)
    clocks.append(Clock({}, of_sample=index, expected=outputs))
    return clocks
