# SPDX-License-Identifier: BSD-3-Clause
"""Requested points are numbers that are set on a test bench."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cocotb_tests.support.drives import PAPER
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.plan.bench_point import neighbours, on_the_bench

NOMINAL = load_nominal(PAPER)


def test_requested_points_are_round_and_within_the_limits():
    rng, machine = np.random.default_rng(3), NOMINAL.machine
    draws = [rng.uniform(*ends, 200) for ends in ((-900, 900), (0, 1), (0, 6.3))]
    for omega, size, angle in zip(*draws, strict=True):
        i = size * machine.rated_current_a * np.exp(1j * angle)
        within = lambda w, x, omega=omega, i=i: abs(w) <= abs(omega) and abs(x) <= abs(i)  # noqa: E731
        speed, current = on_the_bench(float(omega), complex(i), machine, within)
        assert within(speed, current)
        for x, exact in ((speed, omega), (current.real, i.real), (current.imag, i.imag)):
            assert x == float(f"{x:.2g}") and abs(x - exact) <= 0.11 * abs(exact) + 1e-12
    assert neighbours(0.0) == (0.0,) and neighbours(-304.7) == (-310.0, -300.0) and neighbours(25.0) == (25.0,)
    large = replace(machine, rated_current_a=300.0)
    assert on_the_bench(100.0, 0.234 + 120.0j, large) == (100.0, 0.2 + 120.0j)
