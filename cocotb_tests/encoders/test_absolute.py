# SPDX-License-Identifier: BSD-3-Clause
"""Serial absolute encoders against models of the encoders: single-bit errors are caught, any cable, RTL as golden."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.needs import skip_without_ghdl5
from cocotb_tests.support.peripherals import absolute_model as models
from cocotb_tests.support.peripherals.absolute_bench import BEGIN, BITS, CODE, ERROR, VALID, run
from cocotb_tests.support.peripherals.golden_player import GoldenPlayer
from fluxproof.cosim.verilated import VerilatedCore
from golden_model.encoders import biss_master, endat_master, position_bridge
from golden_model.registry import BLOCKS

FRAMES = 100_000
IN_VERILATOR = 20_000  # frames
FEWER = 20  # times fewer frames in the tests than in the study
LAYOUTS = [(17, 17, 1, 0), (26, 13, 2, 5), (32, 20, 3, 20)]


def setting(name: str, word: int, turn: int, half: int, answer: int, cable: int) -> tuple[dict[str, int], int, int]:
    """(registers, timeout of the encoder, clocks of a frame); start_max is half a period above what is needed."""
    period = 2 * (half + 1)
    registers = {"half_period": half, "word_bits": word, "turn_bits": turn}
    timeout = 2 * period
    if name == "ssi_master":
        registers |= {"gray": word & 1, "parity_on": 1}
    elif name == "biss_master":
        registers |= {"crc_on": 1, "start_max": (half + 1) * (3 + 2 * answer) + cable + 3 + half}
    else:
        registers |= {"crc_on": 1, "mode_command": 0b000111 if word % 2 else 0b111000, "two_errors": 1 - word % 2}
        registers |= {"start_max": period * (1 + answer) + cable + 3 + half}
    return registers, timeout, period * (word + answer + 30) + 2 * cable + timeout + BEGIN


def frames_of(name: str, words: list[int], registers: dict[str, int]) -> list[list[int]]:
    width = registers["word_bits"]
    rows = [models.bits_of(word, width) for word in words]
    if name == "ssi_master":
        return [models.ssi_word(row, bool(registers["gray"]), bool(registers["parity_on"])) for row in rows]
    if name == "biss_master":
        return [models.biss_frame(row) for row in rows]
    return [models.endat_frame(row, [0, 1][: 1 + registers["two_errors"]]) for row in rows]


def code_of(words: np.ndarray, turn: int) -> np.ndarray:
    """The place within a turn with 18 bits."""
    place = words & ((1 << turn) - 1)
    return place >> (turn - BITS) if turn >= BITS else place << (BITS - turn)


@pytest.mark.parametrize("name", ["ssi_master", "biss_master", "endat_master"])
@pytest.mark.parametrize(("word", "turn", "half", "cable"), LAYOUTS)
def test_single_bit_errors_are_caught(name, word, turn, half, cable):
    catch(name, word, turn, half, cable, FRAMES // FEWER, IN_VERILATOR // FEWER)


@pytest.mark.study
@pytest.mark.parametrize("name", ["ssi_master", "biss_master", "endat_master"])
def test_every_single_bit_error_is_caught(name, figure):
    wrong = sum(catch(name, *layout, FRAMES // 3 + 1, IN_VERILATOR) for layout in LAYOUTS)
    what = f"{name}: frames with a wrong bit that gave a code, of {wrong} in {3 * (FRAMES // 3 + 1)}"
    figure(what, 0, 0, "frames", True)


def catch(name, word, turn, half, cable, frames_given, in_verilator) -> int:
    """Of frames with one wrong bit none gives a code, of good ones each the right one: how many had one."""
    if name == "ssi_master":
        cable = min(cable, 2 * half - 1)  # SSI has no start bit: the line may be late by less than a period
    rng = np.random.default_rng(word)
    answer = 2
    registers, timeout, spacing = setting(name, word, turn, half, answer, cable)
    words = rng.integers(1 << word, size=frames_given)
    frames, wrong = models.frames_with_errors(rng, frames_of(name, words.tolist(), registers))
    result, line, starts = run(name, frames, registers, answer, cable, timeout, spacing)
    good = wrong < 0
    assert 0.05 < good.mean() < 0.2 and len(np.unique(wrong)) == frames.shape[1] + 1
    assert (result[:, VALID] + result[:, ERROR] == 1).all(), "each frame has one end"
    assert (result[good, VALID] == 1).all()
    assert (result[good, CODE] == code_of(words[good], turn)).all()
    caught = result[~good, ERROR]
    assert caught.all(), f"wrong bits at {np.unique(wrong[~good][caught == 0])} of {frames.shape[1]} were not noticed"

    # The same line and the same starts into the RTL: all outputs, the serial clock among them
    if word == 17:
        skip_without_ghdl5()
        clocks = in_verilator * spacing
        core = VerilatedCore({"POSITION_BITS": BITS}, top=name)
        core.set_many(registers)
        core.reset()
        block = BLOCKS[name]
        names = [p.name for p in block.outputs]
        inputs = {"serial_data": line[:clocks], "start": starts[:clocks]}
        got, wanted = core.play(inputs, names), GoldenPlayer(block, {"POSITION_BITS": BITS}, registers).play(inputs)
        for k, port in enumerate(names):
            assert (got[:, k] == wanted[port]).all(), f"{port} differs"
    return int((~good).sum())


def test_crcs_of_the_golden_model_are_those_of_long_division():
    rng = np.random.default_rng(1)
    for _ in range(300):
        bits = [int(b) for b in rng.integers(2, size=int(rng.integers(1, 60)))]
        assert biss_master.crc_of(bits) == [1 - b for b in models.remainder(bits, 0b1000011)]
        assert endat_master.crc_of(bits) == [1 - b for b in models.remainder(bits, 0b101011, 0b11111)]


@pytest.mark.parametrize("name", ["biss_master", "endat_master"])
def test_status_of_the_encoder(name):
    """Error bits make the frame bad, and the alarm tells; without a CRC check a wrong CRC passes."""
    registers, timeout, spacing = setting(name, 18, 18, 1, 3, 4)
    word = models.bits_of(0x2A5C3, 18)
    if name == "biss_master":
        frames = [models.biss_frame(word), models.biss_frame(word, error=0), models.biss_frame(word, warning=0)]
    else:
        frames = [models.endat_frame(word, errors) for errors in ([0, 1], [1, 1], [0, 0])]
    result, line, starts = run(name, np.array(frames), registers, 3, 4, timeout, spacing)
    out = GoldenPlayer(BLOCKS[name], {"POSITION_BITS": BITS}, registers).play({"serial_data": line, "start": starts})
    ends = [n * spacing + spacing - 1 for n in range(3)]
    if name == "biss_master":
        assert result[:, VALID].tolist() == [1, 0, 1]
        assert out["alarm"][ends].tolist() == [0, 1, 0] and out["warning"][ends].tolist() == [0, 0, 1]
    else:
        assert result[:, VALID].tolist() == [1, 0, 0] and out["alarm"][ends].tolist() == [0, 1, 1]
    bad = np.array(frames[:1])
    bad[0, -1] ^= 1
    for crc_on in (0, 1):
        result, _, _ = run(name, bad, registers | {"crc_on": crc_on}, 3, 4, timeout, spacing)
        assert result[0, VALID] == 1 - crc_on


@pytest.mark.parametrize("name", ["ssi_master", "biss_master", "endat_master"])
@pytest.mark.parametrize("level", [0, 1])
def test_a_broken_wire_is_an_error(name, level):
    registers, _, spacing = setting(name, 17, 17, 1, 2, 0)
    start = (np.arange(5 * spacing) % spacing == 10).astype(np.int64)
    out = GoldenPlayer(BLOCKS[name], {"POSITION_BITS": BITS}, registers).play(
        {"serial_data": np.full(len(start), level, np.int64), "start": start}
    )
    assert out["frame_error"].sum() == 5 and out["code_valid"].sum() == 0


def bridge(samples: int, speed: float, lost: list[int], delay: float, growth: float = 0.0):
    """(outputs per sample, true place at each sampling instant) of position_bridge; ``speed`` in turns a sample."""
    spacing, latency = 20, 7
    k = np.arange(samples)
    when = k - delay  # the encoder latches so long before the currents are sampled
    place = 0.1 + speed * when + growth * when**2 / 2
    inputs = {name: np.zeros(samples * spacing, np.int64) for name in ("frame_code", "frame_valid", "sample")}
    frame = k * spacing + spacing - latency
    inputs["frame_code"][frame] = (place % 1.0 * (1 << BITS)).astype(np.int64)
    inputs["frame_valid"][frame] = ~np.isin(k, lost)
    inputs["sample"][k * spacing + spacing - 1] = 1
    registers = {"delay": position_bridge.DELAY.to_int(delay), "bridge_max": 4}
    out = GoldenPlayer(position_bridge.BLOCK, {"POSITION_BITS": BITS}, registers).play(inputs)
    seen = np.flatnonzero(out["code_valid"])
    assert (np.diff(seen) == spacing).all()
    true = 0.1 + speed * k + growth * k**2 / 2
    return {name: values[seen] for name, values in out.items()}, true[: len(seen)]


def off(code: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Error in steps of the code."""
    return ((code / (1 << BITS) - true + 0.5) % 1.0 - 0.5) * (1 << BITS)


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0, 2.3])
@pytest.mark.parametrize("speed", [0.0, 1e-4, 0.013, -0.013, 0.2, -0.4])
def test_delay_is_compensated_and_gaps_are_bridged(delay, speed):
    """At constant speed each code is right within its quantisation, also of bridged samples and the first after."""
    lost = [20, 30, 31, 40, 41, 42, 43]
    out, true = bridge(60, speed, lost, delay)
    gap = 4  # samples; a step of quantisation in delta grows with them and with the delay
    assert np.abs(off(out["code_theta"], true)[2:]).max() <= 2 + gap + delay
    assert out["position_lost"].max() == 0 and out["bridged_count"][-1] == len(lost)


def test_a_bridge_while_the_speed_changes():
    """The error of a bridge is that of the missing acceleration and is gone with the first good frame but one."""
    growth, lost = 1e-4, [20, 21, 22]
    out, true = bridge(60, 0.01, lost, 0.5, growth=growth)
    error = off(out["code_theta"], true) / (1 << BITS)
    assert np.abs(error[20:23]).max() <= growth * 3.5 * 4.5 / 2 + 1e-4
    assert np.abs(error[25:]).max() <= 0.5 * 1.5 * growth + 3 / (1 << BITS)


def test_too_long_a_gap_trips_until_cleared():
    out, _ = bridge(40, 0.01, [10, 11, 12, 13, 20, 21, 22, 23, 24], 0.0)
    lost = out["position_lost"]
    assert lost[:24].max() == 0 and lost[25:].min() == 1
    never, _ = bridge(10, 0.0, list(range(10)), 0.0)
    assert never["position_lost"][-1] == 1 and never["position_valid"].max() == 0


def test_every_second_frame_bad_while_the_speed_changes():
    """delta follows: each bridged place is off by the acceleration of a few samples, however long it lasts."""
    growth = 1e-4
    out, true = bridge(120, 0.01, list(range(11, 120, 2)), 0.0, growth=growth)
    error = off(out["code_theta"], true) / (1 << BITS)
    assert np.abs(error[20:]).max() <= 3.0 * growth + 2 / (1 << BITS)
    assert out["position_lost"].max() == 0
