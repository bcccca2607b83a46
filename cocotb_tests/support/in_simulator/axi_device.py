# SPDX-License-Identifier: BSD-3-Clause
"""The AXI top in GHDL as a device of the closed loop (fluxproof/cosim/closed_loop.py): software actions go over AXI."""

from __future__ import annotations

from collections.abc import Mapping

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, First, ReadOnly, RisingEdge, ValueChange
from cocotbext.axi import AxiLiteBus, AxiLiteMaster, AxiResp, AxiStreamBus, AxiStreamSink

from fluxproof.cosim.block_bench import read
from fluxproof.cosim.closed_loop import FLAGS, SAMPLE_DELAY, Period
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.ghdl_device import CLOCK_NS, now
from fluxproof.cosim.inside import handle_of
from golden_model.fluxproof import OBSERVED, Observed
from golden_model.generated.register_names import ADDRESSES
from golden_model.io.register_file import from_word, to_word

PINS = ("adc_a", "adc_b", "adc_c", "adc_u_dc", "position_code")
REFERENCES = ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode", "temp_winding", "temp_valid", "clear_faults")


class AxiDevice:
    """Drives fluxproof_axi: converters at the pins, the rest through registers, one period behind the scenario's.

    A sample takes the references that are in the registers when it comes.  Those of the next period are written from
    the moment on at which the sample of this one has come: the core must hold them back until it is over.  ``scenario``
    says what they will be.
    """

    def __init__(self, dut, scenario: Scenario):
        self.dut, self.scenario = dut, scenario
        self.edges: list[tuple[int, int]] = []
        self.word, self.start_clock, self.number = 0, 0, 0
        self.written: dict[str, int] = {}
        self.observed = [(n, handle_of(dut.core, n), bool(OBSERVED[n].fmt.signed)) for n in Observed._fields]
        for name in (*PINS, "sample_valid", "trip", "aresetn", "s_axi_awprot", "s_axi_arprot"):
            getattr(dut, name).value = 0
        Clock(dut.aclk, CLOCK_NS, unit="ns").start()

    async def write(self, name: str, value: int) -> None:
        """A register over the bus; the core must take it."""
        data = to_word(int(value)).to_bytes(4, "little")
        answer = await self.bus.write(ADDRESSES[name], data)
        assert answer.resp == AxiResp.OKAY, f"{name} = {value} was answered with {answer.resp.name}"

    async def read(self, name: str) -> int:
        """A word over the bus: 32 bits, unsigned."""
        answer = await self.bus.read(ADDRESSES[name], 4)
        assert answer.resp == AxiResp.OKAY, f"reading {name} was answered with {answer.resp.name}"
        return int.from_bytes(answer.data, "little")

    async def read_signed(self, name: str) -> int:
        """A word over the bus as a signed number."""
        return from_word(await self.read(name))

    async def _watch_gates(self):
        high, low = self.dut.gate_high, self.dut.gate_low
        while True:
            await First(ValueChange(high), ValueChange(low))
            clock = now()
            await FallingEdge(self.dut.aclk)
            word = read(high, False) + 8 * read(low, False)
            if word != self.word:
                self.word = word
                self.edges.append((clock, word))

    async def start(self, registers, enable: int, words=()) -> Period:
        """Reset, load every register over the bus, telemetry on; ends with a sample_trigger."""
        assert not enable, "a watchdog waits for the first sample: enable later"
        await ClockCycles(self.dut.aclk, 8)
        self.bus = AxiLiteMaster(
            AxiLiteBus.from_prefix(self.dut, "s_axi"),
            self.dut.aclk,
            self.dut.aresetn,
            reset_active_level=False,
        )
        self.stream = AxiStreamSink(
            AxiStreamBus.from_prefix(self.dut, "m_axis"),
            self.dut.aclk,
            self.dut.aresetn,
            reset_active_level=False,
        )
        self.dut.aresetn.value = 1
        cocotb.start_soon(self._watch_gates())
        await ClockCycles(self.dut.aclk, 2)
        for word in words:
            await self.write("table_word", word)
        for name, value in registers._asdict().items():
            await self.write(name, value)
        await self._references(0)
        await self.write("telemetry_enable", 1)
        assert not self.edges, "gates moved before enable"
        await RisingEdge(self.dut.sample_trigger)
        self.start_clock = now()
        return Period(None, np.zeros(0, np.int64), np.zeros(0, np.int64), 0, 0, 0)

    async def period(self, inputs: dict[str, int], enable: int) -> Period:
        dut = self.dut
        await FallingEdge(dut.aclk)
        await self._enable(enable)
        for name in PINS:
            getattr(dut, name).value = inputs[name]
        for _ in range(SAMPLE_DELAY):
            await FallingEdge(dut.aclk)
        running = read(dut.core.running, False)
        dut.sample_valid.value = 1
        await FallingEdge(dut.aclk)
        dut.sample_valid.value = 0
        began = now()
        self.number += 1
        writing = cocotb.start_soon(self._references(self.number))
        await RisingEdge(dut.core.duty_valid)
        duty_clocks = now() + 1 - began
        await RisingEdge(dut.core.values_valid)
        await FallingEdge(dut.aclk)
        observed = {name: 0 if handle is None else read(handle, signed) for name, handle, signed in self.observed}
        await writing
        await self.after_sample()
        return await self._finish(observed, duty_clocks, running)

    async def after_sample(self) -> None:
        """Hook for tests when the values of a sample are valid."""

    def change(self, registers: Mapping[str, int]) -> None:
        """Already written in the last period, see _references."""
        assert all(self.written[name] == value for name, value in registers.items())

    async def _enable(self, value: int) -> None:
        """On or off, written only when it changes."""
        if self.written.get("enable", 0) != value:
            self.written["enable"] = value
            await self.write("enable", value)

    async def _references(self, k: int) -> None:
        """What the sample of period ``k`` shall find in the registers, as far as it is new."""
        s = self.scenario
        if k >= len(s):
            return
        columns = (s.omega_ref, s.i_d_ref, s.i_q_ext, s.speed_mode, *s.slow_inputs())
        wanted = {name: int(column[k]) for name, column in zip(REFERENCES, columns, strict=True)}
        for name, value in {**wanted, **s.changes.get(k, {})}.items():
            if self.written.get(name, 0) != value:
                self.written[name] = value
                await self.write(name, value)

    async def _finish(self, observed, duty_clocks: int, running: int) -> Period:
        await RisingEdge(self.dut.sample_trigger)
        await ReadOnly()
        end = now()
        mine = [(c, w) for c, w in self.edges if c < end]
        self.edges = [(c, w) for c, w in self.edges if c >= end]
        clocks = np.array([c - self.start_clock for c, _ in mine], np.int64)
        words = np.array([w for _, w in mine], np.int64)
        length, self.start_clock = end - self.start_clock, end
        flags = tuple(read(getattr(self.dut.core, name), False) for name in FLAGS)
        return Period(observed, clocks, words, length, duty_clocks, running, flags)
