# SPDX-License-Identifier: BSD-3-Clause
"""Rough rides for encoder front ends: inputs clock by clock for RTL and golden model alike, seeded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cocotb_tests.support.peripherals.incremental_model import Incremental, glitches, wandering
from golden_model.encoders import turn_counter

BITS = 16
COUNTS = (4000, 10000, 4096, 52, 30)


def incremental(seed: int, clocks: int) -> Iterator[tuple[dict[str, int], dict[str, np.ndarray]]]:
    """(registers, inputs) of ``clocks`` clocks after another for incremental_encoder, without an end.

    Speeds up to an edge in 4 clocks, reversals, edges that bounce, glitches short and long, lines that are lost, Z at
    every phase, starts, clearing, samples too close and far apart.
    """
    rng = np.random.default_rng(seed)
    place = 0.0
    while True:
        counts = int(rng.choice(COUNTS))
        phase = int(rng.integers(4))
        width = float(rng.choice([0.9, 2.0, 3.8]))
        encoder = Incremental(
            counts,
            index_from=phase + 0.5 - width / 2,
            index_width=width,
            phase_error=float(rng.uniform(-0.3, 0.3)),
            duty_error=float(rng.uniform(-0.2, 0.2)),
            jitter=float(rng.choice([0.0, 0.02, 0.1])),
        )
        filter_clocks = int(rng.choice([0, 1, 2, 3]))
        path = wandering(rng, clocks, 0.25, place)
        place = path[-1]
        for _ in range(int(rng.integers(3))):  # the disc slips by up to 9 lines
            path[int(rng.integers(clocks)) :] += float(rng.integers(-36, 37))
        pins = glitches(encoder.pins(path, rng), rng, every=int(rng.choice([150, 3000])), longest=filter_clocks + 2)
        registers = turn_counter.setting(counts, BITS) | {
            "filter_clocks": filter_clocks,
            "index_phase": phase,
            "correct_max": int(rng.choice([0, 8, 100])),
            "reverse": int(rng.integers(2)),
            "index_once": int(rng.integers(4) > 0),
            "k_edge": int(rng.integers(1 << 32)),
            "whole_lines": int(rng.integers(2)),
        }
        spacing = int(rng.choice([30, 60, 500]))
        once = {"sample": spacing, "start": clocks // 3, "clear_faults": clocks // 4}
        strobes = {name: (rng.integers(every, size=clocks) == 0).astype(np.int64) for name, every in once.items()}
        yield registers, {**pins, **strobes, "start_count": rng.integers(counts, size=clocks)}
