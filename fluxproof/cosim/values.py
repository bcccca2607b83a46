# SPDX-License-Identifier: BSD-3-Clause
"""Numbers for the samples of a bench: random ones of every size, and ones at which something in the block changes."""

from __future__ import annotations

from functools import cache

import numpy as np

from golden_model.block import Port


@cache
def corner_values(port: Port) -> list[int]:
    """Both ends of the legal range, and around zero where it is signed."""
    return sorted({v for v in (port.low, -1, 0, 1, port.high) if port.low <= v <= port.high})


def random_value(rng: np.random.Generator, port: Port) -> int:
    """Half the time uniform, else a corner or a number of random magnitude: small ones matter too."""
    draw = rng.bit_generator.random_raw  # 64 bits: the fastest there is, and noise needs millions
    choice, kind = divmod(draw(), 4)
    if kind == 0:
        values = corner_values(port)
        return values[choice % len(values)]
    value = port.low + (draw() * (port.high - port.low + 1) >> 64)
    if kind == 1:
        value >>= choice % port.fmt.width
    return min(max(value, port.low), port.high)


def values_of(state) -> list[int]:
    """Every number in a state, which may hold other states."""
    if state is None:
        return []
    if isinstance(state, tuple):
        return [value for part in state for value in values_of(part)]
    return [int(state)]


def near(rng: np.random.Generator, ports: tuple[Port, ...], row: dict[str, int], state=None, of=None) -> dict[str, int]:
    """The row with one number (the port ``of``, or any) beside another, where a comparison changes or little is left.

    It becomes another port's value, of the same weight, one of ``state``, or a power of two, with either sign, or
    stays; then it moves by at most one LSB, or a single bit of it is inverted.
    """
    words = [p for p in ports if not p.is_bit]
    if not words:
        return row
    port, other = (words[int(rng.integers(len(words)))] for _ in range(2))
    port = of or port
    value, inside = row[port.name], values_of(state)
    kind = rng.integers(4) if not inside else rng.integers(8)
    shift = port.fmt.frac_bits - other.fmt.frac_bits
    if kind == 0:
        value = row[other.name] << shift if shift >= 0 else row[other.name] >> -shift
    elif kind == 1:
        value = 1 << int(rng.integers(port.fmt.width))
    elif kind > 3:  # a number inside has no format here: as it is, or with another port's weight
        value = inside[int(rng.integers(len(inside)))] >> (abs(shift) if kind == 4 else 0)
    if kind in (0, 1, 4, 5) and rng.integers(2):
        value = -value
    if kind == 2 or (kind > 3 and rng.integers(4) == 0):
        value ^= 1 << int(rng.integers(port.fmt.width))
    else:
        value += int(rng.integers(-1, 2))
    return row | {port.name: min(max(value, port.low), port.high)}


def one_size(ports: tuple[Port, ...], rng: np.random.Generator) -> dict[str, int]:
    """Numbers of about one size, from the full range to a few bits; one port has another size."""
    draw = rng.bit_generator.random_raw
    size, other, row = rng.random() ** 2, draw() % len(ports), {}
    for n, p in enumerate(ports):
        drop = int((rng.random() if n == other else size) * p.fmt.width)
        row[p.name] = min(max((p.low + (draw() * (p.high - p.low + 1) >> 64)) >> drop, p.low), p.high)
    return row


def edge(run, state, name: str, flat: dict[str, int], steep: dict[str, int], rng) -> list[dict[str, int]]:
    """The rows between ``flat`` and ``steep`` where a value ceases to be the one of ``flat``, in any order.

    The value is any that differs: an output, or half the time one that the block holds afterwards.
    """

    def values(row: dict[str, int]) -> list[int]:
        after, outputs = run(state, row)
        return values_of(after) if holds and after is not None else list(outputs.values())

    holds = rng.integers(2)
    first, last = values(flat), values(steep)
    differing = [k for k, value in enumerate(first) if value != last[k]]
    if differing:
        place = differing[int(rng.integers(len(differing)))]
        while abs(steep[name] - flat[name]) > 1:
            middle = flat | {name: (flat[name] + steep[name]) // 2}
            if values(middle)[place] == first[place]:
                flat = middle
            else:
                steep = middle
    return [flat, steep] if rng.integers(2) else [steep, flat]
