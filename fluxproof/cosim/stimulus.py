# SPDX-License-Identifier: BSD-3-Clause
"""What the one bench feeds a block: samples, made from the block's declaration and a seed.

Every registered block gets the same treatment: all corner combinations of its ports (sampled where there are too
many), its own hard cases, the same with something changed, values beside one another and beside what the block holds,
random values.  What is drawn may depend on the state before the sample: whoever plays the samples sends it.
"""

from __future__ import annotations

import itertools
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fluxproof.cosim.values import corner_values, edge, near, one_size, random_value
from golden_model.block import Block, Port

BURST = 40  # samples between two changes of the registers
SHORTEST = 10  # rows of a block's own hard cases that are played again
SAMPLES, CLOCKS = 300, 2000  # the same at most
FEW = 100  # varied samples at least
OFTEN, SELDOM, NEVER = 60, 250, 0  # samples from one reset to the next


@dataclass(frozen=True)
class Length:
    """How much of what is drawn at random; a block's own hard cases always come in full."""

    corners: int  # combinations of corner values at most
    near: int  # samples beside one another
    varied: int  # clocks of the block's own hard cases with something changed
    random: int  # samples
    alike: int  # samples whose numbers are all of one size
    edges: int  # places where a single LSB of an input changes an output
    clocked: int  # random clocks of a block whose sample is the clock
    patient: bool  # whether the cases come too that take long, such as a wide counter at its end


SHORT = Length(300, 100, 500, 150, 0, 0, 500, False)  # GHDL, some ten thousand clocks a second
MEDIUM = Length(1500, 400, 2000, 1200, 0, 0, 0, False)  # the model against floating point, both in Python
LONG = Length(1500, 500, 30000, 1500, 2000, 1000, 10000, True)  # Verilator


class Sample(NamedTuple):
    """One sample and the distance of resets around it."""

    row: dict[str, int]
    resets: int = OFTEN  # one in so many samples; NEVER: none


# Yields samples and is sent the state before the next one; None where nobody knows it.
Samples = Generator[Sample, object, None]


def corners(ports: tuple[Port, ...], rng: np.random.Generator, most: int) -> Iterator[dict[str, int]]:
    """Every combination of corner values; of both ends only, or a sample, where there are too many."""
    for choose in (corner_values, lambda p: sorted({p.low, p.high})):
        choices = [choose(p) for p in ports]
        if np.prod([float(len(c)) for c in choices]) <= most:
            break
    else:
        for _ in range(most):
            yield {p.name: int(rng.choice(corner_values(p))) for p in ports}
        return
    for values in itertools.product(*choices):
        yield dict(zip((p.name for p in ports), values, strict=True))


def samples(block: Block, config: Mapping[str, int], seed: int, length: Length = LONG) -> Samples:
    """All samples, in order, each within the ranges of its ports.  Raises ValueError for an own case that is not."""
    rng = np.random.default_rng(seed)
    ranges = [(p.name, p.low, p.high) for p in block.ports(config)]
    draw = _clocked(block, config, rng, length) if block.clocked else _strobed(block, config, rng, length)
    sample = next(draw, None)
    while sample is not None:
        row = block.possible(sample.row, config) if block.possible else sample.row
        for name, low, high in ranges:
            if not low <= row[name] <= high:
                raise ValueError(f"stimulus of {block.name}: {name}={row[name]} is outside its range")
        state = yield Sample(row, sample.resets)
        try:
            sample = draw.send(state)
        except StopIteration:
            return


def _own(block: Block, config: Mapping[str, int], rng, length: Length) -> tuple[list[dict[str, int]], list]:
    """The block's own hard cases, and those for who has patience; a port that they leave out is 0.

    The patient see the own ones twice, without a reset too: a counter gets to its end in no other way.
    """
    still = {p.name: 0 for p in block.ports(config)}
    own = block.stimuli(rng, config) if block.stimuli else []
    patient = block.patient_stimuli(rng, config) if block.patient_stimuli and length.patient else []
    patient = own + patient if length.patient else []
    return [still | row for row in own], [still | row for row in patient]


def _strobed(block: Block, config: Mapping[str, int], rng, length: Length) -> Samples:
    """For a block that gets a sample now and then."""
    ports = block.ports(config)
    own, patient = _own(block, config, rng, length)
    for row in corners(ports, rng, length.corners):
        yield Sample(row)
    for row in own:
        yield Sample(row, SELDOM)
    for row in patient:
        yield Sample(row, NEVER)
    row, state = {}, None
    for k in range(length.near):  # differs little from the one before
        if k % 4 == 0:
            row = {p.name: random_value(rng, p) for p in ports}
        row = near(rng, ports, row, state)
        state = yield Sample(row)
    yield from _varied(ports, own, rng, max(FEW, length.varied // block.interval), SAMPLES)
    registers = {p.name: 0 for p in block.registers}
    for k in range(length.random):
        row = {p.name: random_value(rng, p) for p in ports}
        if k % BURST == 0:
            registers = {p.name: row[p.name] for p in block.registers}
        yield Sample(row | registers)
    yield from _alike(block, ports, rng, length.alike)
    yield from _edges(block, config, own, rng, length.edges)


def _alike(block: Block, ports: tuple[Port, ...], rng: np.random.Generator, count: int) -> Samples:
    """Numbers of about one size: products that cross a rounding edge, near zero too; settings stay for a burst."""
    held = {}
    for k in range(count):
        row = one_size(ports, rng)
        if k % BURST == 0:
            held = {p.name: row[p.name] for p in block.registers}
        yield Sample(row | held)


def _edges(block: Block, config: Mapping[str, int], own: list[dict[str, int]], rng, count: int) -> Samples:
    """Both sides of places where one LSB of an input matters: where a rounding turns, a comparison, or a limit begins.

    They are found by halving what lies between two samples.  Some follow one another without other changes: what the
    first one leaves in the block, right or not, shows at the edge of the next.
    """
    ports, run = block.ports(config), block.runner(config)
    words = [p for p in ports if not p.is_bit]
    row, state = {}, block.state
    for k in range(count if words else 0):
        if k % 4 == 0:
            row = own[int(rng.integers(len(own)))] if own and rng.integers(2) else one_size(ports, rng)
            row = block.possible(row, config) if block.possible else row
        port = words[int(rng.integers(len(words)))]
        ends = [row | {port.name: random_value(rng, port)} for _ in range(2)]
        for row in edge(run, state, port.name, *ends, rng):
            state = yield Sample(row, SELDOM)


def _clocked(block: Block, config: Mapping[str, int], rng, length: Length) -> Samples:
    """For a block whose sample is the clock."""
    ports = block.ports(config)
    own, patient = _own(block, config, rng, length)
    for row in own:
        yield Sample(row, 3 * SELDOM)
    for row in patient:
        yield Sample(row, NEVER)
    yield from _varied(ports, patient or own, rng, length.varied, CLOCKS)
    yield from _held(ports, rng, length.clocked)


def _varied(
    ports: tuple[Port, ...], own: list[dict[str, int]], rng: np.random.Generator, count: int, longest: int
) -> Samples:
    """Stretches of a block's own hard cases with something changed: what it expects goes on, but not quite so.

    Now and then a row is beside the block's state, comes twice, or is left out.
    """
    state, done = None, 0
    news = [k for k, row in enumerate(own) if row != own[k - 1]] or [0]  # a stretch begins where something happens
    while own and done < count:
        size = int(SHORTEST * (longest / SHORTEST) ** rng.random())
        begin = news[int(rng.integers(len(news)))]
        held, inverted = _change(ports, own[begin], rng, state)
        changes = int(rng.choice([10, 40, 10**9]))  # one row in so many
        for row in own[begin : begin + size]:
            row = row | held
            row |= {p.name: min(max(row[p.name] ^ bit, p.low), p.high) for p, bit in inverted}
            change = int(rng.integers(3)) if rng.integers(changes) == 0 else -1
            if change == 0:
                row = near(rng, ports, row, state)
            for _ in range((1, 2, 0)[max(change, 0)]):
                state = yield Sample(row, 3 * SELDOM)
                done += 1


def _change(ports: tuple[Port, ...], row: dict[str, int], rng, state) -> tuple[dict[str, int], list[tuple[Port, int]]]:
    """(values that some ports keep, bits that are inverted in others) for a stretch that begins with ``row``.

    One time in three the inverted bits have the same weight in several ports: numbers that were beside one another, a
    limit and what is compared with it, are so still, somewhere else.
    """
    if rng.integers(3) == 0:
        of = ports[int(rng.integers(len(ports)))]
        weight = int(rng.integers(of.fmt.width)) - of.fmt.frac_bits
        places = [(p, weight + p.fmt.frac_bits) for p in ports if not p.is_bit and rng.integers(4)]
        return {}, [(p, 1 << place) for p, place in places if 0 <= place < p.fmt.width - bool(p.fmt.signed)]
    held, inverted = {}, []
    for number in rng.choice(len(ports), min(int(rng.integers(1, 4)), len(ports)), replace=False):
        port = ports[number]
        if rng.integers(4) == 0:
            inverted.append((port, 1 << int(rng.integers(port.fmt.width))))
        elif rng.integers(2) == 0:
            held[port.name] = random_value(rng, port)
        else:
            held[port.name] = near(rng, ports, row, state, port)[port.name]
    return held, inverted


def _held(ports: tuple[Port, ...], rng: np.random.Generator, count: int) -> Samples:
    """Random values, each held for a random while of its own; flags mostly at rest, so that something happens."""
    calm = {"enable": 1, "trip": 0}
    row, state = {p.name: random_value(rng, p) for p in ports} | calm, None
    names = {p.name for p in ports}
    pace = {}
    for k in range(count):
        if k % 500 == 0:  # clocks from change to change, and how often a flag is up then
            pace = {p.name: (float(rng.choice([2, 8, 60, 1000])), float(rng.choice([0.03, 0.5, 0.97]))) for p in ports}
        for p in ports:
            if rng.random() * pace[p.name][0] < 1:
                if p.is_bit:
                    row = row | {p.name: int(rng.random() < pace[p.name][1])}
                else:
                    row = row | {p.name: random_value(rng, p)} if rng.integers(3) else near(rng, ports, row, state, p)
        if rng.integers(40) == 0:
            row = {**row, **calm}
            if "dead_time" in row:
                row = {**row, "dead_time": int(rng.integers(1, 9)), "min_pulse": 10}
        state = yield Sample({name: value for name, value in row.items() if name in names}, 3 * SELDOM)
