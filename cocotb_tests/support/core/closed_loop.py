# SPDX-License-Identifier: BSD-3-Clause
"""The RTL in closed loop: one run, and the pulses of a leg on its gate edges."""

from __future__ import annotations

import numpy as np

from fluxproof.cosim.runs import Named


def close_loop(engine, path, scenario: str, carrier_half: int, key: str = "", periods: int | None = None):
    """(summary, arrays, registers) of one run; fails with the first difference."""
    named = Named("fluxproof.cosim.runs:closed_loop", (str(path), carrier_half, scenario, periods))
    job = engine(f"test {scenario} {carrier_half}{key}", named)
    job.carry_out()
    assert job.problem is None, job.problem
    return job.summary(), job.arrays(), job.run.registers


def leg_runs(edges: np.ndarray, leg: int, period: int):
    """[(start, stop, which)] of one leg's gate pulses in clocks since the start; which is 'high' or 'low'."""
    clocks = edges[:, 0] * period + edges[:, 1]
    runs = []
    for name, bit in (("high", leg), ("low", leg + 3)):
        on = (edges[:, 2] >> bit) & 1
        change = np.flatnonzero(np.diff(on, prepend=0))
        starts, stops = clocks[change[on[change] == 1]], clocks[change[on[change] == 0]]
        runs += [(int(a), int(b), name) for a, b in zip(starts, stops, strict=False)]
    return sorted(runs)
