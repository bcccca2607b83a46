# SPDX-License-Identifier: BSD-3-Clause
"""The VHDL in GHDL as a device of the closed loop (cosim/closed_loop.py): one period at a time."""

from __future__ import annotations

import gc
from collections.abc import Sequence

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge, ValueChange
from cocotb.utils import get_sim_time

from fluxproof.cosim.block_bench import read
from fluxproof.cosim.closed_loop import FLAGS, SAMPLE_DELAY, Period
from golden_model.fluxproof import OBSERVED, Observed
from golden_model.io import sample_latch

CLOCK_NS = 10


def now() -> int:
    """Rising edges since the start of the clock; exact, the clock's period is a whole number of nanoseconds."""
    return int(get_sim_time("ns")) // CLOCK_NS


async def prepare(dut, registers, enable: int = 0, words: Sequence[int] = ()) -> None:
    """Registers set, all other inputs zero, clock started, four clocks of reset; ends at a falling edge.

    ``words``: values of table_word that load the torque table before, one a clock.
    """
    inputs = {p.name: 0 for p in sample_latch.BLOCK.inputs if p.name != "run_in"}
    inputs |= {"sample_valid": 0, "trip": 0, "clear_trip": 0, "host_write": 0, "enable": enable, "rst": 1}
    for name, value in {**registers._asdict(), **inputs}.items():
        getattr(dut, name).value = int(value)
    Clock(dut.clk, CLOCK_NS, unit="ns").start()
    for word in words:
        dut.table_word.value = word
        await FallingEdge(dut.clk)
    for _ in range(4):
        await FallingEdge(dut.clk)
    dut.rst.value = 0


class GhdlDevice:
    """Drives the top entity; gate edges are recorded by tasks of their own."""

    def __init__(self, dut):
        self.dut = dut
        self.edges: list[tuple[int, int]] = []
        self.word = 0
        self.start_clock = 0
        self.observed = [(n, getattr(dut, n), bool(OBSERVED[n].fmt.signed)) for n in Observed._fields]

    async def _watch_gates(self, gates):
        high, low = self.dut.gate_high, self.dut.gate_low
        while True:
            await ValueChange(gates)
            # Both vectors change at a rising edge; half a clock later both have settled, and one task sees both.
            clock = now()
            await FallingEdge(self.dut.clk)
            word = int(read(high, False)) + 8 * int(read(low, False))
            if word != self.word:
                self.word = word
                self.edges.append((clock, word))

    async def start(self, registers, enable: int, words: Sequence[int] = ()) -> Period:
        await prepare(self.dut, registers, enable, words)
        for gates in (self.dut.gate_high, self.dut.gate_low):
            cocotb.start_soon(self._watch_gates(gates))
        gc.freeze()  # what is imported stays: the collector need not search it again and again
        self.start_clock = now()
        return await self._finish(None, 0, 0)

    async def period(self, inputs: dict[str, int], enable: int) -> Period:
        dut = self.dut
        dut.enable.value = enable
        for name, value in inputs.items():
            getattr(dut, name).value = value
        for _ in range(SAMPLE_DELAY):
            await FallingEdge(dut.clk)
        running = read(dut.running, False)
        dut.sample_valid.value = 1
        await FallingEdge(dut.clk)
        dut.sample_valid.value = 0
        began = now()
        await RisingEdge(dut.duty_valid)
        duty_clocks = now() + 1 - began  # the edge at which a follower would see duty_valid
        await RisingEdge(dut.values_valid)
        await FallingEdge(dut.clk)
        observed = {name: read(handle, signed) for name, handle, signed in self.observed}
        return await self._finish(observed, duty_clocks, running)

    def change(self, registers) -> None:
        for name, value in registers.items():
            getattr(self.dut, name).value = int(value)

    async def _finish(self, observed, duty_clocks: int, running: int | str) -> Period:
        await RisingEdge(self.dut.sample_trigger)
        end = now()
        await FallingEdge(self.dut.clk)
        mine = [(c, w) for c, w in self.edges if c < end]
        self.edges = [(c, w) for c, w in self.edges if c >= end]
        clocks = np.array([c - self.start_clock for c, _ in mine], np.int64)
        words = np.array([w for _, w in mine], np.int64)
        length, self.start_clock = end - self.start_clock, end
        flags = tuple(read(getattr(self.dut, name), False) for name in FLAGS)
        return Period(observed, clocks, words, length, duty_clocks, running, flags)
