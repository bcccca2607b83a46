# SPDX-License-Identifier: BSD-3-Clause
"""The core with its telemetry inside GHDL: every word of every packet against the golden model, whatever the sink does.

Leaves the closed loop's stream in capture.bin and what the core answered in observed.npz, in the folder of the run.
"""

from __future__ import annotations

import os

import cocotb
import numpy as np
from cocotb.triggers import FallingEdge

from fluxproof.cosim.block_bench import read
from fluxproof.cosim.closed_loop import cosimulate
from fluxproof.cosim.driven_plant import INPUT_PORTS
from fluxproof.cosim.ghdl_device import GhdlDevice, prepare
from fluxproof.cosim.scenarios import SCENARIOS
from fluxproof.cosim.values import random_value
from fluxproof.diagnosis.replay import telemetry_stream
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.io import sample_latch
from golden_model.io.telemetry_words import COUNT, HEADER_WORD, pack
from golden_model.registers import registers

INTERVAL = fluxproof.SAMPLE_INTERVAL
PERIODS = 160  # of the closed loop


class Sink:
    """Takes words with probability ``pace`` a clock and watches what AXI4-Stream asks of a source."""

    def __init__(self, dut, rng):
        self.dut, self.rng, self.pace, self.words, self.lasts = dut, rng, 1.0, [], []
        self.stalls = 0

    async def run(self):
        dut, shown = self.dut, None
        while True:
            await FallingEdge(dut.clk)
            now = None
            if read(dut.m_axis_tvalid, False) == 1:
                now = (read(dut.m_axis_tdata, False), read(dut.m_axis_tlast, False))
                assert all(isinstance(value, int) for value in now), f"metavalues on the stream: {now}"
            if shown is not None and read(dut.rst, False) == 0:
                assert now == shown, f"changed before it was taken: {shown} became {now}"
            ready = int(self.rng.random() < self.pace)
            dut.m_axis_tready.value = ready
            shown = now
            if now is not None and ready and read(dut.rst, False) == 0:
                self.words.append(now[0])
                self.lasts.append(now[1])
                shown = None
            self.stalls += int(now is not None and not ready)

    def packets(self) -> list[tuple[int, ...]]:
        """The words so far as packets; checks the position of the last-word marks."""
        assert self.lasts == [int((k + 1) % COUNT == 0) for k in range(len(self.words))]
        return [tuple(self.words[k : k + COUNT]) for k in range(0, len(self.words), COUNT)]


class Bench:
    """Feeds samples and keeps what the golden model makes of them."""

    def __init__(self, dut):
        self.dut, self.rng = dut, np.random.default_rng(int(os.environ["FLUXPROOF_SEED"]))
        drive = drives.load(os.environ["FLUXPROOF_DRIVE"])
        self.drive = drives.with_carrier(drive, int(os.environ["FLUXPROOF_CARRIER_HALF"]))
        self.registers = registers(self.drive)
        self.sink = Sink(dut, self.rng)
        self.wanted: list[tuple[int, ...]] = []
        self.state = fluxproof.State()
        self.busy = False

    async def start(self):
        self.dut.m_axis_tready.value = 0
        self.dut.telemetry_enable.value = 1
        await prepare(self.dut, self.registers.values, enable=1)
        cocotb.start_soon(self.sink.run())
        await self._settle()

    async def reset(self):
        """Reset in the middle of whatever is going on; the sink's words stay."""
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        self.state = fluxproof.State()
        await self._settle()

    async def _settle(self):
        """The gates take over their settings, the minimum pulse among them, at the first valley."""
        for _ in range(2 * self.registers.config.carrier_half + 2):
            await FallingEdge(self.dut.clk)

    async def sample(self, clocks: int = INTERVAL):
        """One random sample, then ``clocks`` - 1 clocks: the next may follow at once."""
        config = self.registers.config._asdict()
        sized = {p.name: p for p in sample_latch.BLOCK.ports({name.upper(): v for name, v in config.items()})}
        values = [random_value(self.rng, sized[name]) for name in INPUT_PORTS]
        for name, value in zip(INPUT_PORTS, values, strict=True):
            getattr(self.dut, name).value = value
        self.dut.sample_valid.value = 1
        sample = fluxproof.Sample(*values, read(self.dut.running, False))
        await FallingEdge(self.dut.clk)
        self.dut.sample_valid.value = 0
        self.state, seen = fluxproof.step(self.state, sample, self.registers.values, self.registers.config)
        self.wanted.append(pack(len(self.wanted), {**sample._asdict(), **seen._asdict()}))
        for name in INPUT_PORTS:  # inputs need not stay constant
            getattr(self.dut, name).value = random_value(self.rng, sized[name])
        for clock in range(1, clocks):
            self.busy = clock < INTERVAL - 2  # a strobe in the next two clocks would still be too early
            await FallingEdge(self.dut.clk)

    async def drain(self):
        self.sink.pace = 1.0
        for _ in range(4 * INTERVAL + (1 << int(os.environ["FLUXPROOF_DEPTH_BITS"]))):
            await FallingEdge(self.dut.clk)
        assert read(self.dut.m_axis_tvalid, False) == 0


@cocotb.test()
async def shortest_interval(dut):
    """Samples as close as they may come, a sink that often waits: a packet for each, none lost."""
    bench = Bench(dut)
    await bench.start()
    bench.sink.pace = 0.65
    for _ in range(120):
        await bench.sample()
    await bench.drain()
    assert bench.sink.packets() == bench.wanted and bench.sink.stalls > 500
    assert read(dut.dropped, False) == 0


@cocotb.test()
async def early_samples(dut):
    """Where the core lets no early sample in: the telemetry takes none either, and numbers go on without them."""
    if not hasattr(dut, "early_samples"):
        cocotb.log.info("this core has no guard against early samples")
        return
    bench = Bench(dut)
    await bench.start()

    async def intrude():
        while True:
            for _ in range(int(bench.rng.integers(60, 200))):
                await FallingEdge(dut.clk)
            if read(dut.sample_valid, False) == 0 and bench.busy:
                dut.sample_valid.value = 1
                await FallingEdge(dut.clk)
                dut.sample_valid.value = 0

    intruding = cocotb.start_soon(intrude())
    for _ in range(80):
        await bench.sample(INTERVAL + int(bench.rng.integers(3)))
    intruding.cancel()
    assert read(dut.early_samples, False) > 5
    await bench.drain()
    assert bench.sink.packets() == bench.wanted


@cocotb.test()
async def long_stalls(dut):
    """A sink that stops for many samples: whole packets are lost and counted, all others are as they should be."""
    bench = Bench(dut)
    await bench.start()
    for round_number in range(3):
        bench.sink.pace = 0.0
        for _ in range(30 + 7 * round_number):
            await bench.sample(INTERVAL + int(bench.rng.integers(30)))
        bench.sink.pace = 0.8
        for _ in range(20):
            await bench.sample()
    await bench.drain()
    packets = bench.sink.packets()
    numbers = [words[1] for words in packets]
    assert numbers == sorted(set(numbers)) and packets == [bench.wanted[k] for k in numbers]
    lost = len(bench.wanted) - len(packets)
    kept = (1 << int(os.environ["FLUXPROOF_DEPTH_BITS"])) // COUNT
    assert read(dut.dropped, False) == lost > 3 * (30 - kept) - 9


@cocotb.test()
async def off_and_on(dut):
    """Switched at any clock: packets whole, samples without one not counted as dropped, their numbers missing."""
    bench = Bench(dut)
    await bench.start()
    bench.sink.pace = 0.9

    async def switch():
        while True:
            for _ in range(int(bench.rng.integers(20, 300))):
                await FallingEdge(dut.clk)
            dut.telemetry_enable.value = int(bench.rng.integers(2))

    switching = cocotb.start_soon(switch())
    for _ in range(100):
        await bench.sample()
    switching.cancel()
    await bench.drain()
    packets = bench.sink.packets()
    assert 15 < len(packets) < 90 and packets == [bench.wanted[words[1]] for words in packets]
    assert read(dut.dropped, False) == 0


@cocotb.test()
async def reset_in_mid_packet(dut):
    """What comes after a reset is whole and counts from 0; the reader finds it behind the piece that was cut off."""
    bench = Bench(dut)
    await bench.start()
    runs, cut = [], 0
    for round_number in range(12):
        bench.wanted = []
        bench.sink.pace = 1.0 if round_number % 2 else 0.7
        for _ in range(5):
            await bench.sample()
        for _ in range(int(bench.rng.integers(1, INTERVAL))):
            await FallingEdge(dut.clk)
            if round_number % 3 == 0 and read(dut.m_axis_tvalid, False) == 1:
                break  # in these rounds surely inside a packet
        runs.append(bench.wanted)
        cut += read(dut.m_axis_tvalid, False)
        await bench.reset()
    bench.wanted = []
    for _ in range(5):
        await bench.sample()
    await bench.drain()
    raw = np.array(bench.sink.words, "<u4").tobytes()
    capture = telemetry_stream.parse(raw)
    assert cut > 2 and capture.left, "no reset ever cut a packet"
    assert len(capture.pieces) == 13
    for piece, wanted in zip(capture.pieces, [*runs, bench.wanted], strict=True):
        assert piece.counter.tolist() == list(range(len(piece))) and 3 <= len(piece) <= 5
        for k in range(len(piece)):
            assert pack(k, {name: values[k] for name, values in piece.fields.items()}) == wanted[k]
    assert len(capture.pieces[-1]) == 5 and bench.sink.words[-COUNT] == HEADER_WORD


@cocotb.test()
async def closed_loop(dut):
    """The drive in closed loop, its stream into a file: the tests outside turn it into a dump and replay it."""
    bench = Bench(dut)
    dut.m_axis_tready.value = 0
    dut.telemetry_enable.value = 1
    bench.sink.pace = 0.5
    cocotb.start_soon(bench.sink.run())
    scenario = SCENARIOS["everything"](bench.drive).first(PERIODS)
    result = await cosimulate(GhdlDevice(dut), bench.drive, bench.registers, scenario)
    await bench.drain()
    assert result.differences == 0, result.first_difference
    assert len(bench.sink.packets()) == len(scenario)
    np.array(bench.sink.words, "<u4").tofile("capture.bin")
    np.savez("observed.npz", **result.observed)
