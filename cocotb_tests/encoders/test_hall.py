# SPDX-License-Identifier: BSD-3-Clause
"""Hall sensors against a model of the sensors: angle, steps, illegal codes, the start of an incremental encoder."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.peripherals.golden_player import GoldenPlayer
from cocotb_tests.support.peripherals.incremental_model import Incremental, wandering
from golden_model.encoders import edge_timer, hall_decoder, incremental_encoder, turn_counter

DELAY = 1  # clocks from the sensors to theta_hall


def sensors(turns: np.ndarray) -> dict[str, np.ndarray]:
    """Three sensors a third of an electrical turn apart, each 1 for half a turn, a from 0; ``turns``: electrical."""
    names = ("hall_a", "hall_b", "hall_c")
    return {n: ((turns - k / 3) % 1.0 < 0.5).astype(np.int64) for k, n in enumerate(names)}


def player(**registers: int) -> GoldenPlayer:
    return GoldenPlayer(hall_decoder.BLOCK, {}, registers)


@pytest.mark.parametrize("reverse", [0, 1])
def test_angle_within_a_twelfth_of_a_turn(reverse):
    rng = np.random.default_rng(1)
    turns = wandering(rng, 200_000, 0.01)
    offset = 0.3
    out = player(hall_reverse=reverse, hall_offset=int(offset * 2**18)).play(
        {**sensors(-turns if reverse else turns), "settled": np.ones(len(turns), np.int64)}
    )
    error = (out["theta_hall"] / 2**18 - offset - turns + 0.5) % 1.0 - 0.5
    assert np.abs(error).max() <= 1 / 12 + 2 / 2**18
    assert out["illegal_count"][-1] == out["skipped_count"][-1] == 0 and out["hall_valid"].all()
    sixths = np.cumsum(out["step_up"] - out["step_down"])
    assert np.abs(sixths / 6 - (turns - turns[0])).max() <= 1 / 6 + 1e-9


def test_illegal_codes_are_counted_and_the_sector_stays():
    turns = np.linspace(0.1, 3.1, 3000)
    pins = sensors(turns) | {"settled": np.ones(len(turns), np.int64)}
    broken = [(500, 520), (1500, 1501), (2500, 2560)]
    for k, (begin, end) in enumerate(broken):
        for name in ("hall_a", "hall_b", "hall_c"):
            pins[name][begin:end] = k & 1
    out = player().play(pins)
    assert out["illegal_count"][-1] == len(broken)
    for begin, end in broken:
        assert not out["hall_valid"][begin:end].any() and out["hall_valid"][end]
        assert (out["sector"][begin:end] == out["sector"][begin - 1]).all()


@pytest.mark.parametrize(("counts", "pole_pairs"), [(4000, 4), (10000, 7), (4096, 1)])
def test_start_of_an_incremental_encoder(counts, pole_pairs):
    """Until the index the electrical angle is that of the Hall sensors within a sector's half; then it is exact."""
    rng, tried = np.random.default_rng(2), 0
    for begin in rng.uniform(0.05, 0.95, 6):
        place = (begin * counts + 0.01 * np.arange(2000 + counts)) % counts
        turns = place / counts * pole_pairs
        hall = player(
            sector_counts=hall_decoder.setting(counts, pole_pairs),
            start_first=round(counts / (12 * pole_pairs)),
        ).play({**sensors(turns), "settled": np.ones(len(turns), np.int64)})
        assert hall["start_valid"][20:].all()
        start = (np.arange(len(turns)) == 30).astype(np.int64)
        regs = turn_counter.setting(counts, 16) | {"filter_clocks": 1, "correct_max": 10, "index_once": 1}
        encoder = GoldenPlayer(incremental_encoder.BLOCK, {"POSITION_BITS": 16}, regs)
        pins = Incremental(counts).pins(place, rng)
        out = encoder.play({**pins, "start": start, "start_count": hall["start_count"]})
        rows = slice(40 + counts, None)  # the count has arrived
        if out["referenced"].any():
            continue
        tried += 1
        assert not out["moving"][rows].any()
        error = (out["count"] * pole_pairs / counts - turns + 0.5) % 1.0 - 0.5
        assert np.abs(error[rows]).max() <= 1 / 12 + 2 * pole_pairs / counts
    assert tried > 3


def test_speed_of_hall_steps():
    """The edge timer on the sectors' steps: 6 counts an electrical turn."""
    every, speed = 10_000, 2e-5  # turns a clock
    turns = speed * np.arange(3_000_000)
    steps = player().play({**sensors(turns), "settled": np.ones(len(turns), np.int64)})
    clock_hz, omega_base = 100e6, 2 * np.pi * 5000.0
    registers = {"k_edge": edge_timer.setting(6, 1, clock_hz, omega_base)}
    sample = (np.arange(len(turns)) % every == 0).astype(np.int64)
    inputs = {"step_up": steps["step_up"], "step_down": steps["step_down"], "sample": sample}
    out = GoldenPlayer(edge_timer.BLOCK, edge_timer.BLOCK.configs[0], registers).play(inputs)
    wanted = 2 * np.pi * speed * clock_hz / omega_base
    omega = out["omega_me"][np.flatnonzero(out["omega_valid"])][5:] / 2**16
    assert np.abs(omega / wanted - 1).max() < 1e-3
