"""What the one bench feeds a block: a schedule of clocks, made from the block's declaration and a seed.

Every registered block gets the same treatment: all corner combinations of its ports (sampled where there
are too many), its own hard cases, seeded random values; samples back to back and with gaps; inputs that
are noise before and after the contract wants them; resets in mid-stream, with samples in flight.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from fluxproof.golden_model.block import Block, Port

CORNERS_AT_MOST = 1500
RANDOM_SAMPLES = 1200
NEAR_SAMPLES = 400
CLOCKED_RANDOM = 6000  # clocks
BURST = 40  # samples between two changes of the registers
SETTLED = 2  # strobes are compared after this clock


@dataclass
class Due:
    """What a bench compares before a clock's rising edge; the inputs are still those of the clock before."""

    strobes: dict[str, int] = field(default_factory=dict)  # out_valid, out_soon
    outputs: list[tuple[str, int]] = field(default_factory=list)
    still: bool = False  # every output is as it was before the edge of the clock before
    of_sample: int = -1


@dataclass
class Clock:
    """One clock: what is driven before its rising edge, and what must be seen before the next one."""

    writes: dict[str, int]
    in_valid: int = 0
    rst: int = 0
    sample: int = -1  # index of the sample that enters here
    out_valid: int = 0
    of_sample: int = -1  # index of the sample whose outputs are due here
    expected: dict[str, int] = field(default_factory=dict)
    soon: dict[str, int] = field(default_factory=dict)  # outputs due with out_soon


def corner_values(port: Port) -> list[int]:
    """Both ends of the legal range, and around zero where it is signed."""
    return sorted({v for v in (port.low, -1, 0, 1, port.high) if port.low <= v <= port.high})


def random_value(rng: np.random.Generator, port: Port) -> int:
    """Half the time uniform, else a corner or a number of random magnitude: small ones matter too."""
    kind = rng.integers(4)
    if kind == 0:
        return int(rng.choice(corner_values(port)))
    value = int(rng.integers(port.low, port.high, endpoint=True))
    if kind == 1:
        value >>= int(rng.integers(0, port.fmt.width))
    return min(max(value, port.low), port.high)


def near(rng: np.random.Generator, ports: tuple[Port, ...], row: dict[str, int]) -> dict[str, int]:
    """The row with one number beside another one, where a comparison changes or a difference is small.

    It becomes another port's value, of the same weight, or a power of two, with either sign, or stays; then it moves by
    at most one LSB, or a single bit of it is inverted.
    """
    words = [p for p in ports if not p.is_bit]
    if not words:
        return row
    port, other = (words[int(rng.integers(len(words)))] for _ in range(2))
    value = row[port.name]
    kind = rng.integers(4)
    if kind == 0:
        shift = port.fmt.frac_bits - other.fmt.frac_bits
        value = row[other.name] << shift if shift >= 0 else row[other.name] >> -shift
    elif kind == 1:
        value = 1 << int(rng.integers(port.fmt.width))
    if kind < 2 and rng.integers(2):
        value = -value
    if kind == 2:
        value ^= 1 << int(rng.integers(port.fmt.width))
    else:
        value += int(rng.integers(-1, 2))
    return row | {port.name: min(max(value, port.low), port.high)}


def corners(ports: tuple[Port, ...], rng: np.random.Generator) -> Iterator[dict[str, int]]:
    """Every combination of corner values; of both ends only, or a sample, where there are too many."""
    for choose in (corner_values, lambda p: sorted({p.low, p.high})):
        choices = [choose(p) for p in ports]
        if np.prod([float(len(c)) for c in choices]) <= CORNERS_AT_MOST:
            break
    else:
        for _ in range(CORNERS_AT_MOST):
            yield {p.name: int(rng.choice(corner_values(p))) for p in ports}
        return
    for values in itertools.product(*choices):
        yield dict(zip((p.name for p in ports), values, strict=True))


def samples(block: Block, config: dict[str, int], seed: int) -> list[dict[str, int]]:
    """All samples, in order: corners, the block's own hard cases, random ones."""
    rng = np.random.default_rng(seed)
    ports = block.ports(config)
    rows = list(corners(ports, rng))
    if block.stimuli is not None:
        rows += [{**{p.name: 0 for p in ports}, **row} for row in block.stimuli(rng, config)]
    rows += _beside(block, ports, rng)
    registers = {p.name: 0 for p in block.registers}
    for k in range(RANDOM_SAMPLES):
        row = {p.name: random_value(rng, p) for p in ports}
        if k % BURST == 0:
            registers = {p.name: row[p.name] for p in block.registers}
        rows.append(row | registers)
    if block.possible is not None:
        rows = [block.possible(row, config) for row in rows]
    for row in rows:
        for p in ports:
            if not p.low <= row[p.name] <= p.high:
                raise ValueError(f"stimulus of {block.name}: {p.name}={row[p.name]} is outside its range")
    return rows


def _beside(block: Block, ports: tuple[Port, ...], rng: np.random.Generator) -> list[dict[str, int]]:
    """Rows that differ little from the one before, and ports that differ little from one another."""
    rows, row = [], {}
    for k in range(NEAR_SAMPLES):
        if k % 4 == 0:
            row = {p.name: random_value(rng, p) for p in ports}
        row = near(rng, ports, row)
        rows.append(row)
    return rows


def schedule(block: Block, config: dict[str, int], seed: int) -> list[Clock]:
    """Clock by clock, with what the model says must come out and when."""
    if block.clocked:
        return _clocked_schedule(block, config, seed)
    rng = np.random.default_rng(seed + 1)
    noise_ports = tuple(p for p in block.ports(config) if p.name in {q.name for q in block.inputs})
    clocks: list[Clock] = [Clock({}, rst=1), Clock({}, rst=1)]
    state, registers, last, resets = block.state, None, -(10**9), 0

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
    for index, row in enumerate(samples(block, config, seed)):
        wanted_registers = {p.name: row[p.name] for p in block.registers}
        start = max(len(clocks), last + block.interval)
        if wanted_registers != registers:
            start = max(start, last + block.latency + 1)
        elif rng.integers(4) == 0:
            start += int(rng.integers(1, 2 * block.latency))
        if index and block.strobes and rng.integers(60) == 0:
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
        state, outputs = block.run(state, row, config)
        due.append((last + block.latency, index, outputs))
        if block.soon:
            soon.append((last + block.latency - block.ahead, index, {name: outputs[name] for name in block.soon}))
        arrivals += [(last, p, row[p.name], random_value(rng, p)) for p in late]
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

    Strobes are compared from the fourth clock on, in every one of them: the reset has two clocks to work.
    """
    strobes = block.strobes and not block.clocked
    entries = []
    for number, clock in enumerate(clocks):
        entry = Due(of_sample=clock.of_sample)
        if strobes and number > SETTLED:
            entry.strobes["out_valid"] = clock.out_valid
            if block.soon:
                entry.strobes["out_soon"] = int(bool(clock.soon))
                entry.outputs += clock.soon.items()
        # Before the first clock nothing was seen, and a reset may leave anything behind.
        entry.still = block.atomic and not clock.out_valid and number > 0 and not clocks[number - 1].rst
        for name, value in clock.expected.items():
            if clock.expected.get(block.shown_with.get(name), 1):
                entry.outputs.append((name, value))
        entries.append(entry)
    return entries


def _clocked_schedule(block: Block, config: dict[str, int], seed: int) -> list[Clock]:
    """For a block whose sample is the clock: its own hard cases, then random ones, with resets.

    Outputs are due before the edge that follows the sample's; in reset they are zero but for ``after_reset``.
    """
    rng = np.random.default_rng(seed)
    rows = block.stimuli(rng, config) + _held_random(block, config, rng, CLOCKED_RANDOM)
    clocks, state = [Clock({}, rst=1), Clock({}, rst=1)], block.state
    at_rest = {p.name: 0 for p in block.outputs} | dict(block.after_reset)
    outputs, of_sample = at_rest, -1
    for index, row in enumerate(rows):
        reset = int(rng.integers(700) == 0)
        clocks.append(Clock(dict(row), rst=reset, sample=index, of_sample=of_sample, expected=outputs))
        if reset:
            state, outputs = block.state, at_rest
        else:
            state, outputs = block.run(state, row, config)
        of_sample = index
    clocks.append(Clock({}, of_sample=of_sample, expected=outputs))
    return clocks


def _held_random(block: Block, config: dict[str, int], rng, count: int) -> list[dict[str, int]]:
    """Random values, each held for a random while, flags mostly at rest, so that something can happen."""
    ports = block.ports(config)
    names = {p.name for p in ports}
    rows: list[dict[str, int]] = []
    calm = {"enable": 1, "trip": 0}
    row = {p.name: random_value(rng, p) for p in ports} | calm
    for _ in range(count):
        if rng.integers(30) == 0:
            port = ports[int(rng.integers(len(ports)))]
            row = {**row, port.name: random_value(rng, port)} if rng.integers(3) else near(rng, ports, row)
        if rng.integers(40) == 0:
            row = {**row, **calm}
            if "dead_time" in row:
                row = {**row, "dead_time": int(rng.integers(1, 9)), "min_pulse": 10}
        rows.append({name: value for name, value in row.items() if name in names})
    return rows
