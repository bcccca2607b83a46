# SPDX-License-Identifier: BSD-3-Clause
"""Hall sensors against a model of the sensors: angle, steps, illegal codes, the start of an incremental encoder."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.peripherals.golden_player import GoldenPlayer
from cocotb_tests.support.peripherals.incremental_model import Incremental, wandering
from fluxproof.checkout import DRIVES
from fluxproof.cosim.sensor_edges import edges_of, hall_code
from golden_model.drive import load
from golden_model.encoders import edge_timer, hall_angle, hall_decoder, incremental_encoder, turn_counter

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
    turns = speed * np.arange(600_000)
    steps = player().play({**sensors(turns), "settled": np.ones(len(turns), np.int64)})
    clock_hz, omega_base = 100e6, 2 * np.pi * 5000.0
    registers = {"k_edge": edge_timer.setting(6, 1, clock_hz, omega_base)}
    sample = (np.arange(len(turns)) % every == 0).astype(np.int64)
    inputs = {"step_up": steps["step_up"], "step_down": steps["step_down"], "sample": sample}
    out = GoldenPlayer(edge_timer.BLOCK, edge_timer.BLOCK.configs[0], registers).play(inputs)
    wanted = 2 * np.pi * speed * clock_hz / omega_base
    omega = out["omega_me"][np.flatnonzero(out["omega_valid"])][5:] / 2**16
    assert np.abs(omega / wanted - 1).max() < 1e-3


def angle_at_samples(turns: np.ndarray, every: int) -> tuple[np.ndarray, np.ndarray]:
    """(clocks of the samples, hall_angle's error there in turns), sectors from hall_decoder."""
    steps = player().play({**sensors(turns), "settled": np.ones(len(turns), np.int64)})
    sample = (np.arange(len(turns)) % every == every - 1).astype(np.int64)
    inputs = {name: steps[name] for name in ("step_up", "step_down", "skipped", "theta_hall")}
    out = GoldenPlayer(hall_angle.BLOCK, hall_angle.BLOCK.configs[0], {}).play({**inputs, "sample": sample})
    at = np.flatnonzero(sample)[:-1]
    return at, (out["theta"][at + hall_angle.TAKES] / 2**18 - turns[at] + 0.5) % 1.0 - 0.5


@pytest.mark.parametrize("speed", [2e-5, -2e-5])
def test_angle_between_hall_edges(speed):
    """From the third edge on the error is a hundredth of a sector; the middle alone is off by half of one."""
    at, error = angle_at_samples(0.02 + speed * np.arange(200_000), 500)
    whole = at * abs(speed) > 3 / 6
    assert np.abs(error[whole]).max() < 0.01 / 6 and np.abs(error).max() <= 1 / 6


def test_angle_of_hall_sensors_stays_in_the_sector_and_rests_at_its_middle():
    """However the shaft turns, the error is below a sector; at rest it goes back to the middle."""
    moving = np.cumsum(np.repeat(np.random.default_rng(5).normal(0.0, 2e-5, 60), 2000))
    rest = np.full(400_000, moving[-1])
    at, error = angle_at_samples(np.concatenate([moving, rest]), 400)
    assert np.abs(error).max() <= 1 / 6 + 1e-4 and np.abs(error[at < len(moving)]).mean() < 1 / 12
    middle = (np.floor(moving[-1] * 6) + 0.5) / 6
    assert abs(error[-1] - (middle - moving[-1])) < 0.1 / 6


def test_simulated_hall_code_is_that_of_the_block():
    """cosim.sensor_edges gives hall_angle its edges at their clocks and leaps over the clocks between."""
    drive, every, clocks = load(DRIVES / "hub_36v.toml"), 4000, 400_000
    edges, seconds = edges_of(drive), np.arange(clocks) / drive.core.clock_hz
    per_s = 20.0 * np.sign(np.sin(2.0 * np.pi * 300.0 * seconds) + 0.4)  # electrical, with reversals at samples
    per_s = np.repeat(per_s[::every], every)
    turns = 0.01 + np.concatenate([[0.0], np.cumsum(per_s[:-1]) / drive.core.clock_hz])
    steps = player().play({**sensors(turns), "settled": np.ones(clocks, np.int64)})
    sample = (np.arange(clocks) % every == 0).astype(np.int64)
    inputs = {name: steps[name] for name in ("step_up", "step_down", "skipped", "theta_hall")}
    block = GoldenPlayer(hall_angle.BLOCK, hall_angle.BLOCK.configs[0], {}).play({**inputs, "sample": sample})
    pairs, bits = drive.machine.pole_pairs, 14
    for at in range(every, clocks - every, every):
        code = hall_code(edges, turns[at] / pairs, per_s[at - 1] / pairs, at / drive.core.clock_hz, bits)
        off = (code - (int(block["theta"][at + hall_angle.TAKES]) >> 18 - bits) + 2 ** (bits - 1)) % 2**bits
        assert abs(off - 2 ** (bits - 1)) <= 2 ** (bits - 8)  # the decoder's clocks
