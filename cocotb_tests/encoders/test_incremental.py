# SPDX-License-Identifier: BSD-3-Clause
"""Incremental encoder against a model of the encoder: angle, speed, index, lost counts, a real capture."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from cocotb_tests.support.peripherals.golden_player import GoldenPlayer
from cocotb_tests.support.peripherals.incremental_model import Incremental, edges, glitches, wandering
from golden_model.encoders import edge_timer, incremental_encoder, turn_counter

BITS = 18
FILTER = 2
DELAY = FILTER + 5  # clocks from a pin to the count that a sample sees
CODE_DELAY = DELAY + 1  # to the code that it latches
SAMPLE = 1000  # clocks
CLOCK_HZ, POLE_PAIRS, OMEGA_BASE = 100e6, 4, 2 * np.pi * 4 * 100.0


# Speeds that single counts read, smallest and largest, then those over whole lines [rpm]
EXTREMES = {1700.0: (1013.2, 5278.7, 1700.0, 1700.1), 3000.0: (2447.2, 3876.1, 2999.8, 3000.2)}


def player(counts: int, **registers: int) -> GoldenPlayer:
    regs = {
        "filter_clocks": FILTER,
        "index_phase": 0,
        "correct_max": 40,
        "reverse": 0,
        "index_once": 1,
        "whole_lines": 0,
    }
    regs |= turn_counter.setting(counts, BITS)
    regs["k_edge"] = edge_timer.setting(counts, POLE_PAIRS, CLOCK_HZ, OMEGA_BASE)
    return GoldenPlayer(incremental_encoder.BLOCK, {"POSITION_BITS": BITS}, regs | registers)


def sampled(clocks: int, every: int = SAMPLE) -> np.ndarray:
    return (np.arange(clocks) % every == every - 1).astype(np.int64)


def angle_error(code: np.ndarray, place: np.ndarray, counts: int) -> np.ndarray:
    """In counts, the shorter way round."""
    return ((code / 2**BITS - place / counts + 0.5) % 1.0 - 0.5) * counts


def speed_of(place: np.ndarray, counts: int) -> np.ndarray:
    """True speed in units of PU's last place, clock by clock."""
    return np.gradient(place) * 2 * np.pi * POLE_PAIRS * CLOCK_HZ / (counts * OMEGA_BASE) * 2**16


@pytest.mark.parametrize("sign", [1, -1])
def test_angle_over_turns(sign):
    assert angle_over_turns(4000, sign, 5)[0] <= 0.5


@pytest.mark.study
@pytest.mark.parametrize("counts", [4000, 10000, 4096, 20, 1 << 17])
def test_angle_over_100_turns(counts, figure):
    """The count is at most half a count off, the code half a step of its own more."""
    pairs = [angle_over_turns(counts, sign, 100 if counts < 1 << 17 else 6) for sign in (1, -1)]
    of_count, of_code = (round(max(pair[k] for pair in pairs), 4) for k in (0, 1))
    most = round(0.5 + 0.5 * counts / 2**BITS, 4)
    figure(f"angle error, {counts} counts, count latched with the sample", of_count, 0.5, "counts", of_count <= 0.5)
    figure(f"angle error, {counts} counts, code of {BITS} bits", of_code, most, "counts", of_code <= most + 1e-4)
    assert of_count <= 0.5


def angle_over_turns(counts: int, sign: int, turns: int) -> tuple[float, float]:
    """(Largest error of the count, of the code) at every sample; the code within half a step of its own more."""
    fastest = 0.2
    rng = np.random.default_rng(counts)
    encoder = Incremental(counts)
    device = player(counts)
    clocks = int(turns * counts / fastest * 1.1)
    start = place = counts / 2 + 0.3
    worst, worst_count, seen = 0.0, 0.0, 0
    speed = sign * fastest * np.minimum(1.0, np.arange(clocks) / (0.1 * clocks))
    for at in range(0, clocks, 1 << 20):
        path = place + np.cumsum(speed[at : at + (1 << 20)])
        sample = sampled(len(path))
        out = device.play({**encoder.pins(path, rng), "sample": sample})
        rows = np.flatnonzero(sample)
        good = rows[(out["referenced"][rows] == 1) & (out["moving"][rows - 1] == 0) & (rows > CODE_DELAY)]
        error = angle_error(out["code_theta"][good], path[good - CODE_DELAY], counts)
        off = out["count"][good] + 0.5 - path[good - CODE_DELAY + 2]
        off = (off + counts / 2) % counts - counts / 2
        worst_count = max(worst_count, np.abs(off).max(initial=0.0))
        worst, seen = max(worst, np.abs(error).max(initial=0.0)), seen + len(good)
        place = path[-1]
    assert abs(place - start) >= turns * counts
    assert seen > 0.8 * clocks / SAMPLE - 2
    assert out["illegal_count"][-1] == out["lost_counts"][-1] == out["index_wrong"][-1] == 0
    assert worst <= 0.5 + 0.5 * counts / 2**BITS
    return worst_count, worst


def test_code_at_every_count():
    """round((count + 1/2) * 2**bits / counts) at every count, up and down and over the turn's end."""
    for counts in (4, 5, 24, 1000, 4096, 10000, 250000, 1 << 18):
        for bits in (12, 16, 18):
            regs = turn_counter.setting(counts, bits)
            device = GoldenPlayer(turn_counter.BLOCK, {"POSITION_BITS": bits}, regs)
            n = counts + 10
            up = np.r_[np.zeros(2, np.int64), np.ones(n, np.int64), np.zeros(n, np.int64)]
            out = device.play({"step_up": up, "step_down": np.roll(up, n), "sample": np.ones(len(up), np.int64)})
            count = out["count"][:-2]  # the code follows by a clock, code_theta by one more
            wanted = (2 * (2 * count + 1) * 2**bits + 2 * counts) // (4 * counts) % 2**bits
            assert (out["code_theta"][2:] == wanted).all()
            assert set(np.unique(count)) == set(range(counts))


@pytest.mark.parametrize("phase", range(4))
@pytest.mark.parametrize("width", [1.0, 2.0, 3.9])
def test_index_at_every_phase_with_reversals(phase, width):
    """No count is ever found lost, however the shaft passes the index: at speed, reversing within it, on its edges."""
    counts, rng = 40, np.random.default_rng(phase)
    # Z covers the middle of the quarter of this phase, which is phase .. phase + 1
    encoder = Incremental(counts, index_from=phase + 0.5 - width / 2, index_width=width, jitter=0.01)
    device = player(counts, index_phase=phase, correct_max=4)
    # Round the index, every size of a swing, then at speed
    swing = np.concatenate([phase + k / 7 + 3 * np.sin(np.linspace(0, 2 * np.pi, 4000)) * k / 30 for k in range(60)])
    path = np.concatenate([np.linspace(-60, phase, 12000), swing, wandering(rng, 60000, 0.1, swing[-1])])
    out = device.play(encoder.pins(path, rng))
    assert out["referenced"][-1] == 1
    assert out["lost_counts"][-1] == out["index_wrong"][-1] == out["illegal_count"][-1] == 0
    at_rest = device.play(encoder.pins(np.full(200, path[-1]), rng))
    assert abs((path[-1] - phase - at_rest["count"][-1] - 0.5 + counts / 2) % counts - counts / 2) <= 0.6


@pytest.mark.parametrize("lost", [4, 8, -12, 36])
def test_lost_counts_are_mended_without_a_jump(lost):
    """Pins that stand still while whole lines pass: found at the next index, counted, corrected a count a sample."""
    counts, rng, speed = 400, np.random.default_rng(1), 0.02 * np.sign(lost)
    encoder, device = Incremental(counts), player(counts)
    clocks = 12 * int(counts / abs(speed))
    path = 10.5 + speed * np.arange(clocks)
    pins = encoder.pins(path, rng)
    begin = int(2.5 * counts / abs(speed))
    end = begin + int(round(abs(lost / speed)))
    for name in pins:  # the pins of `begin` until the same phase comes again
        pins[name][begin:end] = pins[name][begin]
    sample = sampled(clocks, 500)
    out = device.play({**pins, "sample": sample})
    assert out["lost_counts"][-1] == abs(lost) and out["index_lost"][-1] == 1 and out["index_wrong"][-1] == 0
    rows = np.flatnonzero(sample)
    code = out["code_theta"][rows].astype(float) / 2**BITS * counts
    travelled = (np.diff(code) + counts / 2) % counts - counts / 2
    # A step of one count by the correction, one by quantisation
    assert np.abs(travelled)[len(rows) // 5 :].max() <= abs(speed) * 500 + 2.01
    late = rows[rows > end + (1.2 * counts / abs(speed)) + abs(lost) * 500]
    assert np.abs(angle_error(out["code_theta"][late], path[late - CODE_DELAY], counts)).max() <= 0.51


def test_a_wrong_index_is_not_followed():
    """Z far from where it was: flagged, no correction; after clearing, the next index is taken."""
    counts, rng = 400, np.random.default_rng(1)
    device = player(counts, correct_max=20)
    path = 10.5 + 0.05 * np.arange(int(3 * counts / 0.05))
    out = device.play(Incremental(counts).pins(path, rng))
    assert out["index_wrong"][-1] == 0
    moved = Incremental(counts, index_from=100.0)
    before = device.play(moved.pins(path, rng))
    assert before["index_wrong"][-1] == 1 and before["lost_counts"][-1] == 0 and before["referenced"][-1] == 1
    device.play({"clear_faults": np.ones(1, np.int64), **moved.pins(path[:1], rng)})
    after = device.play(moved.pins(path, rng))
    assert after["index_wrong"][-1] == 0 and after["referenced"][-1] == 1
    assert abs(after["count"][-1] - (path[-1] - 100 - DELAY * 0.05) % counts) <= 1.0


@pytest.mark.parametrize("z", ["good", "dead", "stuck", "spike at rest", "spike on the way", "turns back"])
def test_the_index_is_believed_at_its_second_pass(z):
    """Two passes of one place, a turn or a reversal apart; a spike of 300 ns, a stuck or a dead Z make no angle."""
    counts, speed = 400, 0.05
    turns = 2.6 if z == "spike on the way" else 2.2
    path = 100.0 + np.concatenate([np.zeros(200), speed * np.arange(int(turns * counts / speed))])
    if z == "turns back":
        path[-8000:] = 430.0 + np.abs(np.arange(8000) - 4000) * 0.02 - 70.0
        path = np.concatenate([path[:6000], np.linspace(path[5999], path[-8000], 4000), path[-8000:]])
    pins = Incremental(counts).pins(path, np.random.default_rng(1))
    if z in ("dead", "stuck"):
        pins["pin_z"][:] = z == "stuck"
    spikes = {"spike at rest": 100, "spike on the way": 2000}
    if z in spikes:
        pins["pin_z"][spikes[z] : spikes[z] + 80] = 1  # a line long at this speed: every phase
    out = player(counts, index_once=0, correct_max=8).play(pins)
    believed = out["referenced"]
    if z in ("dead", "stuck"):
        assert not believed.any()
        return
    at = np.flatnonzero(believed)[0]
    passes = np.flatnonzero(np.diff(pins["pin_z"]) == 1)
    assert at > passes[1] and believed[at:].all() and not out["index_wrong"].any()
    rows = slice(at + 600, None)  # the count has arrived
    off = (out["count"][rows] - np.floor(path[rows]) + counts / 2) % counts - counts / 2
    assert np.abs(off).max() <= 2


@pytest.mark.parametrize("sign", [1, -1])
def test_speed_from_edges_has_no_step(sign):
    """From far below one count a sample to fifty: the relative error stays small and no sample steps."""
    counts, rng, every = 4000, np.random.default_rng(2), 10_000
    device = player(counts)
    clocks, slowest, ratio = 4_000_000, 1e-5, 700.0
    pace = slowest * ratio ** np.linspace(0, 1, clocks)  # 0.1 to 70 counts a sample
    path = 0.5 + np.cumsum(sign * pace)
    sample = sampled(clocks, every)
    out = device.play({**Incremental(counts).pins(path, rng), "sample": sample}, ("omega_me", "omega_valid"))
    done = np.flatnonzero(out["omega_valid"])
    assert (np.diff(done) == every).all() and done[0] == every - 1 + edge_timer.TAKES - 1
    done = done[done > 500_000]
    at = done - edge_timer.TAKES - DELAY
    true = speed_of(path, counts)[at]
    error = out["omega_me"][done] / true - 1
    # The speed is the mean between two edges, so it lags by two counts and a sample at most, and is a clock of span off
    growth = np.log(ratio) / clocks
    lag = growth * (2 / pace[at] + every)
    assert (np.abs(error) < lag + 3 / every + 1 / np.abs(true)).all()
    steps = np.abs(np.diff(out["omega_me"][done])) / np.abs(true[1:])
    assert (steps < (2 * lag + 6 / every + 2 / np.abs(true))[1:]).all()
    assert np.abs(error[pace[at] * every > 1]).max() < 0.04  # from one count a sample on


def test_speed_falls_to_zero_after_a_stop_and_trembling_has_none():
    counts, rng = 4000, np.random.default_rng(3)
    device = player(counts)
    stop = np.r_[np.cumsum(np.full(200_000, 0.01)), np.full(400_000, 2000.0)]
    out = device.play({**Incremental(counts).pins(stop, rng), "sample": sampled(len(stop))})
    omega = out["omega_me"][np.flatnonzero(out["omega_valid"])]
    falling = omega[201:]
    assert omega[150] > 1000 and (np.diff(falling) <= 0).all()
    one_count = speed_of(np.arange(3.0), counts)[1]
    age = np.arange(1, len(falling) + 1) * SAMPLE
    assert (falling[2:] <= one_count / age[:-2] + 0.5).all()
    # Round an edge, a tenth of a count either way, for long: no step of the count is a movement
    tremble = 2001.0 + 0.1 * np.sin(np.arange(300_000) / 300)
    out = device.play({**Incremental(counts).pins(tremble, rng), "sample": sampled(len(tremble))})
    omega = out["omega_me"][np.flatnonzero(out["omega_valid"])][3:]
    assert len(np.unique(out["count"])) == 2 and np.abs(omega).max() == 0


def uneven_speeds(rpm: float, phase: float, duty: float, clocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Speeds [rpm] of 1,024 uneven counts at 20 kHz, by single counts and over whole lines."""
    counts, rng, every, read = 1024, np.random.default_rng(7), 5000, []
    path = 0.5 + np.cumsum(np.full(clocks, rpm / 60 * counts / CLOCK_HZ))
    pins = Incremental(counts, phase_error=phase, duty_error=duty).pins(path, rng)
    for lines in (0, 1):
        out = player(counts, whole_lines=lines).play({**pins, "sample": sampled(clocks, every)})
        speed = out["omega_me"][np.flatnonzero(out["omega_valid"])][6:]
        read.append(speed / 2**16 * OMEGA_BASE / POLE_PAIRS * 30 / np.pi)
    return read[0], read[1]


@pytest.mark.parametrize("rpm", [1700.0, -3000.0])
@pytest.mark.parametrize("phase, duty", [(25 / 90, 0.4), (-25 / 90, 0.4)])
def test_uneven_counts_do_not_tremble_over_whole_lines(rpm, phase, duty):
    """A and B 90 +- 25 degrees apart, levels of 60 % of a line: single counts tremble, whole lines do not."""
    single, whole = uneven_speeds(rpm, phase, duty, 150_000)
    assert np.abs(whole / rpm - 1.0).max() < 2e-4 and (single / rpm).max() > 1.2


@pytest.mark.study
@pytest.mark.parametrize("rpm", [1700.0, 3000.0])
def test_extremes_of_uneven_counts(rpm, figure):
    """docs/board.md: the largest and smallest speed that single counts and whole lines read."""
    pairs = [uneven_speeds(rpm, p / 90, d, 2_000_000) for p in (25, -25) for d in (0.4, -0.4)]
    low, high, least, most = (
        round(f(np.concatenate(p)), 1) for p in zip(*pairs, strict=True) for f in (np.min, np.max)
    )
    figure(f"speed read at {rpm:g} rpm over whole lines of uneven counts", most, rpm, "rpm", most - least < 1.0)
    assert high > 1.2 * 3000.0 and low < 0.9 * rpm and abs(most / rpm - 1.0) < 2e-4 and abs(least / rpm - 1.0) < 2e-4
    assert (low, high, least, most) == (pytest.approx(EXTREMES[rpm], abs=0.1))


def test_over_whole_lines_a_reversal_begins_a_new_line():
    """No speed from the reversal on until a line is passed, then the true one; over an edge to and fro none at all."""
    counts, rng, every = 4000, np.random.default_rng(8), 400
    steps = np.concatenate([np.full(20_000, 0.007), np.full(20_000, -0.007), 0.03 * np.sin(np.arange(40_000) / 40)])
    path = 0.5 + np.cumsum(steps)
    out = player(counts, whole_lines=1).play(
        {**Incremental(counts).pins(path, rng), "sample": sampled(len(path), every)}
    )
    at = np.flatnonzero(out["omega_valid"])
    omega, true = out["omega_me"][at], speed_of(path, counts)[1000]
    assert np.allclose(omega[(at > 3000) & (at < 20_000)], true, rtol=2e-3)
    turned = omega[(at > 20_000 + edge_timer.TAKES + DELAY + 200) & (at < 20_000 + 500)]
    assert (np.abs(turned) == 0).all() and np.allclose(omega[(at > 22_000) & (at < 40_000)], -true, rtol=2e-3)
    assert len(np.unique(out["count"][-20_000:])) > 1 and np.abs(omega[at > 50_000]).max() == 0


def test_bounce_and_glitches_below_the_filter_change_nothing():
    counts, rng = 4000, np.random.default_rng(4)
    path = wandering(rng, 400_000, 0.05, 20.5)
    clean = Incremental(counts).pins(path, rng)
    dirty = glitches(clean, rng, every=400, longest=FILTER)
    out, same = player(counts).play(dirty), player(counts).play(clean)
    assert out["illegal_count"][-1] == 0
    # An edge may be later by the glitch that hit it
    assert np.abs((out["count"] - same["count"] + counts / 2) % counts - counts / 2).max() <= 1
    assert out["count"][-1] == same["count"][-1]


def test_a_start_before_the_index():
    """The count goes to start_count at once and keeps what the shaft does meanwhile; later starts are ignored."""
    counts, rng = 4000, np.random.default_rng(5)
    path = 1000.5 + 0.01 * np.arange(50_000)
    start = np.zeros(len(path), np.int64)
    start[100] = 1
    device = player(counts)
    out = device.play({**Incremental(counts).pins(path, rng), "start": start, "start_count": 1500 * start})
    assert out["moving"][110] == 1 and out["moving"][5000] == 0 and out["referenced"][-1] == 0
    assert abs(out["count"][-1] - (path[-1] + 500 - (path[100] - path[0]))) <= 1.5
    path = path[-1] + 0.05 * np.arange(60_000)
    start = (np.arange(len(path)) == 55_000).astype(np.int64)
    out = device.play({**Incremental(counts).pins(path, rng), "start": start, "start_count": 7 * start})
    assert out["referenced"][-1] == 1 and abs(out["count"][-1] - path[-1] % counts) <= 1.5


@pytest.mark.parametrize("of", ["tests", pytest.param("study", marks=pytest.mark.study)])
def test_real_capture(of, figure):
    """A capture made inside an FPGA: no edge lost, none illegal, the index found in its quarter."""
    folder = os.environ.get("FLUXPROOF_RECORDINGS")
    file = Path(folder or "") / "encoder_abz" / "capture_edges.csv"
    if not folder or not file.is_file():
        pytest.skip("needs $FLUXPROOF_RECORDINGS with encoder_abz/capture_edges.csv")
    changes = np.loadtxt(file, delimiter=",", skiprows=1, dtype=np.int64)
    at, levels = changes[:, 0], changes[:, 1:]
    rows = levels[np.searchsorted(at, np.arange(at[-1] + 1), side="right") - 1]
    pins = {name: np.r_[np.full(20, rows[0, k]), rows[:, k]] for k, name in enumerate(("pin_a", "pin_b", "pin_z"))}
    # The same file read by hand: each change of A or B is one count, and A lags, so all are backward
    changed = np.abs(np.diff(levels[:, :2], axis=0)).sum(axis=1)
    assert changed.max() == 1 and edges(pins) == changed.sum() == 269
    out = player(4000, index_phase=2).play(pins)
    assert out["illegal_count"][-1] == 0 and out["forward"][-1] == 0
    assert out["referenced"][-1] == 1
    reached = np.flatnonzero(out["referenced"])[0]
    assert abs(reached - (20 + 65500)) < 40  # where Z rises in the file
    behind = changed[at[1:] > 65500].sum()
    assert out["count"][-1] == 4000 - behind
    assert out["count"][20 + 65400] == 4000 - changed[at[1:] < 65400].sum()
    figure("edges lost of a real capture, 269 edges", 0, 0, "edges", True)
