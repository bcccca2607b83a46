# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the gates that are true for any inputs, checked on the model by independent code.

The bench shows that the RTL equals the model at every clock; this shows that the model is safe.
"""

from __future__ import annotations

import numpy as np
import pytest

from golden_model.modulation.gate_generation import BLOCK, step

HALF = 40
CLOCKS = 60_000


def random_clocks(seed: int):
    """Inputs clock by clock: mostly constant, with trips, stops, and settings that change at any clock."""
    rng = np.random.default_rng(seed)
    row = {"compare_a": 10, "compare_b": 20, "compare_c": 30, "enable": 1, "trip": 0, "clear_trip": 0}
    row |= {"dead_time": 3, "min_pulse": 8, "double_update": 0}
    for _ in range(CLOCKS):
        if rng.integers(20) == 0:
            name = rng.choice(["compare_a", "compare_b", "compare_c"])
            row[name] = int(rng.choice([0, 1, HALF - 1, HALF, rng.integers(0, HALF + 1), rng.integers(0, 1 << 16)]))
        if rng.integers(300) == 0:
            row["enable"] ^= 1
        if rng.integers(150) == 0:
            row |= {"dead_time": int(rng.integers(0, 14)), "min_pulse": int(rng.integers(0, 2 * HALF))}
            row["double_update"] = int(rng.integers(2))
        row["trip"] = int(rng.integers(400) == 0)
        row["clear_trip"] = int(rng.integers(200) == 0)
        row["enable"] |= int(rng.integers(100) == 0)
        yield dict(row)


@pytest.mark.parametrize("seed", range(4))
def test_gates_are_safe_under_random_inputs(seed):
    state, previous_trip, tripped_seen, switched = BLOCK.state, 0, 0, 0
    off_since = {(leg, side): 10**6 for leg in range(3) for side in ("high", "low")}
    before, in_force, accepted = (0, 0), 0, False
    for row in random_clocks(seed):
        in_force = state.dead_time
        state, out = step(state, *row.values(), HALF)
        seen = dict(zip((p.name for p in BLOCK.outputs), out, strict=True))
        high, low = seen["gate_high"], seen["gate_low"]
        assert high & low == 0, "both gates of a leg are on"
        if row["trip"] or not row["enable"]:
            assert (high, low) == (0, 0), "gates on one clock after trip or stop"
        if previous_trip and not row["clear_trip"]:
            assert seen["tripped"], "a trip was forgotten"
        if seen["tripped"]:
            assert (high, low) == (0, 0) and not seen["running"]
            tripped_seen += 1
        for leg in range(3):
            for side, now, old in (("high", high, before[0]), ("low", low, before[1])):
                other = "low" if side == "high" else "high"
                if now >> leg & 1:
                    if not old >> leg & 1:
                        switched += 1
                        gap = off_since[leg, other]
                        assert gap >= in_force, f"dead time {gap} of {in_force} clocks"
                    off_since[leg, side] = 0
                else:
                    off_since[leg, side] += 1
        good = 0 < row["dead_time"] < row["min_pulse"] <= HALF
        assert seen["setting_refused"] == (0 if good else 1)
        accepted |= good
        assert accepted or (high, low) == (0, 0), "gates on before any good setting"
        before, previous_trip = (high, low), seen["tripped"]
    assert switched > 1000 and tripped_seen > 1000, "the stimuli did too little"


def test_trip_needs_an_explicit_clear():
    """After a trip the gates stay off; clear_trip has no effect while the trip is present, afterwards it enables."""
    state = BLOCK.state
    calm = {"compare_a": 20, "compare_b": 20, "compare_c": 20, "enable": 1, "trip": 0, "clear_trip": 0}
    calm |= {"dead_time": 3, "min_pulse": 8, "double_update": 0}

    def run(clocks, **changes):
        nonlocal state
        seen = set()
        for _ in range(clocks):
            state, out = step(state, *(calm | changes).values(), HALF)
            seen.add((out[0], out[1]))
        return seen

    assert len(run(6 * HALF)) > 1
    assert run(1, trip=1) == {(0, 0)}
    assert run(10 * HALF) == {(0, 0)}
    assert run(HALF, trip=1, clear_trip=1) == {(0, 0)} and run(6 * HALF) == {(0, 0)}
    run(1, clear_trip=1)
    assert len(run(6 * HALF)) > 1


@pytest.mark.parametrize("compare", [0, HALF])
def test_duty_of_zero_and_of_one(compare):
    """0 % and 100 %: one gate on without a break, the other never."""
    state = BLOCK.state
    words = []
    for _ in range(10 * HALF):
        state, out = step(state, compare, compare, compare, 1, 0, 0, 3, 8, 0, HALF)
        words.append((out[0], out[1]))
    assert set(words[6 * HALF :]) == {(7, 0) if compare else (0, 7)}
