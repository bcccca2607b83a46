# SPDX-License-Identifier: BSD-3-Clause
"""Encoders as their data sheets describe them: the shaft's place to the levels on the pins, clock by clock.

Nothing here is taken from the RTL or its golden model.  ``place``: the shaft in counts (quarters of a line) as real
numbers, one for each clock; it may be any path.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

# A leads B by a quarter of a line when the shaft turns forward; each is high for half a line.
A_RISES, B_RISES, LINE = 1.0, 2.0, 4.0


@dataclass(frozen=True)
class Incremental:
    """An encoder with its faults; the errors of edges are in counts."""

    counts: int
    index_from: float = 0.0  # where Z rises when the shaft turns forward, counts
    index_width: float = 1.0
    phase_error: float = 0.0  # A and B are not exactly a quarter apart
    duty_error: float = 0.0  # high for longer than half a line
    jitter: float = 0.0  # standard deviation of an edge, drawn anew at every clock: bounce at an edge

    def pins(self, place: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Levels of pin_a, pin_b and pin_z, int64, for each clock."""

        def high(start: float, width: float, period: float) -> np.ndarray:
            seen = place + self.jitter * rng.standard_normal(len(place)) if self.jitter else place
            return ((seen - start) % period < width).astype(np.int64)

        half = LINE / 2 + self.duty_error
        return {
            "pin_a": high(A_RISES, half, LINE),
            "pin_b": high(B_RISES + self.phase_error, half, LINE),
            "pin_z": high(self.index_from, self.index_width, float(self.counts)),
        }


def glitches(
    pins: Mapping[str, np.ndarray], rng: np.random.Generator, every: int, longest: int
) -> dict[str, np.ndarray]:
    """The pins with pulses of 1 to ``longest`` clocks, one in ``every`` clocks on the average, on one pin at a time."""
    out = {name: levels.copy() for name, levels in pins.items()}
    names = list(out)
    for at in np.flatnonzero(rng.integers(every, size=len(out[names[0]])) == 0):
        out[names[rng.integers(len(names))]][at : at + rng.integers(1, longest + 1)] ^= 1
    return out


def wandering(rng: np.random.Generator, clocks: int, fastest: float, start: float = 0.0) -> np.ndarray:
    """A path: stretches of constant acceleration, reversals among them; at most ``fastest`` counts a clock."""
    speed = np.empty(clocks)
    at, now = 0, 0.0
    while at < clocks:
        length = int(rng.integers(200, 4000))
        then = fastest * float(rng.choice([0, 0.01, 0.1, 0.5, 1, 1])) * float(rng.choice([-1, 1]))
        stretch = np.linspace(now, then, length)[: clocks - at]
        speed[at : at + len(stretch)] = stretch
        at, now = at + length, then
    return start + np.cumsum(speed)


def edges(pins: Mapping[str, np.ndarray]) -> int:
    """Changes of A and B."""
    return int(sum(np.count_nonzero(np.diff(pins[name])) for name in ("pin_a", "pin_b")))
