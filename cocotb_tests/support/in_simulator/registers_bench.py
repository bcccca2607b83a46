# SPDX-License-Identifier: BSD-3-Clause
"""Clock, reset, bus master, twin and watch of register_file, for the tests of dut_registers.py."""

from __future__ import annotations

import itertools
import random

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, ValueChange
from cocotbext.axi import AxiLiteBus, AxiLiteMaster
from cocotbext.axi.axil_channels import AxiLiteARTransaction, AxiLiteAWTransaction, AxiLiteWTransaction

from fluxproof.cosim.block_bench import read
from golden_model.fluxproof import SAMPLE_INTERVAL
from golden_model.io.register_file import RegisterFile, to_word
from golden_model.io.register_map import Kind, registers
from scripts.registers.rdl import version_word

GENERICS = {
    "adc_bits": 14,
    "position_bits": 17,
    "carrier_half": 1234,
    "clock_hz": 125_000_000,
    "estimators": 0,
    "references": 1,
    "position_loop": 0,
    "residual": 1,
    "modes": 0,
    "overmodulation": 0,
    "gearing": 0,
}
MAP = registers()
WRITABLE = [r for r in MAP.values() if r.kind.writable]
CHANNELS = {
    "b": ("s_axi_bvalid", "s_axi_bready", ("s_axi_bresp",)),
    "r": ("s_axi_rvalid", "s_axi_rready", ("s_axi_rresp", "s_axi_rdata")),
}


class Bench:
    """Clock, reset, the master, the twin, and the watch over outputs and responses."""

    def __init__(self, dut, seed: int) -> None:
        self.dut = dut
        self.rng = random.Random(seed)
        self.twin = RegisterFile(GENERICS, version=version_word())
        self.outputs = {r.name: (r, getattr(dut, r.port.name)) for r in WRITABLE}
        self.inputs = {
            f.name: getattr(dut, f.port.name) for r in MAP.values() if r.kind is Kind.STATUS for f in r.fields
        }
        self.tasks = []

    async def start(self) -> Bench:
        dut = self.dut
        dut.rst.value = 1
        dut.sample_busy.value = 0
        for handle in self.inputs.values():
            handle.value = 0
        Clock(dut.clk, 10, unit="ns").start()
        await ClockCycles(dut.clk, 2)  # the master reads the ready signals at once
        self.master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "s_axi"), dut.clk, dut.rst)
        self.quiet()
        await ClockCycles(dut.clk, 4)
        await FallingEdge(dut.clk)
        dut.rst.value = 0
        await FallingEdge(dut.clk)
        self.tasks = [cocotb.start_soon(self.watch_outputs()), cocotb.start_soon(self.watch_responses())]
        return self

    def quiet(self) -> None:
        for part in (self.master.write_if, self.master.read_if):
            part.log.setLevel("ERROR")

    def hold_back(self, share: float) -> None:
        """Each channel stalls independently for a fraction of the clocks."""
        write, fetch = self.master.write_if, self.master.read_if
        for channel in (
            write.aw_channel,
            write.w_channel,
            write.b_channel,
            fetch.ar_channel,
            fetch.r_channel,
        ):
            rng = random.Random(self.rng.random())
            channel.set_pause_generator(rng.random() < share for rng in itertools.repeat(rng))

    async def write(self, address: int, word: int) -> int | None:
        done = await self.master.write(address, (word & 0xFFFFFFFF).to_bytes(4, "little"))
        return int(done.resp) if done else None  # a reset came between

    async def raw_write(self, address: int, word: int, strobe: int) -> int:
        """A write whose strobes and low address bits are as given."""
        port = self.master.write_if
        await port.aw_channel.send(AxiLiteAWTransaction(awaddr=address, awprot=0))
        await port.w_channel.send(AxiLiteWTransaction(wdata=word, wstrb=strobe))
        return int((await port.b_channel.recv()).bresp)

    async def raw_fetch(self, address: int) -> tuple[int, int]:
        """A read whose low address bits are as given: fetch() would take an unaligned one apart."""
        port = self.master.read_if
        await port.ar_channel.send(AxiLiteARTransaction(araddr=address, arprot=0))
        answer = await port.r_channel.recv()
        return int(answer.rresp), int(answer.rdata)

    async def fetch(self, address: int) -> tuple[int, int] | None:
        done = await self.master.read(address, 4)
        return (int(done.resp), int.from_bytes(done.data, "little")) if done else None

    def held(self) -> dict[str, int | str]:
        """What the outputs hold now."""
        return {name: self.output(name) for name in self.outputs}

    def output(self, name: str) -> int | str:
        register, handle = self.outputs[name]
        return read(handle, bool(register.port.fmt.signed))

    async def note_moves(self, name: str, moved: set[str]) -> None:
        """Add an output that changes to ``moved``: reading all of them at every clock costs most of the run."""
        while True:
            await ValueChange(self.outputs[name][1])
            moved.add(name)

    def check_outputs(self) -> None:
        assert self.held() == self.twin.values

    async def watch_outputs(self) -> None:
        """No register that a sample uses changes at an edge with sample_busy."""
        dut, busy, rst = self.dut, 0, 1
        was_busy, taken = 0, 0
        clear_trip_was = 0
        moved: set[str] = set()
        for name in self.outputs:
            cocotb.start_soon(self.note_moves(name, moved))
        await FallingEdge(dut.clk)
        before = self.held()
        while True:
            await RisingEdge(dut.clk)
            busy, rst = int(dut.sample_busy.value), int(dut.rst.value)
            await FallingEdge(dut.clk)
            now = before | {name: self.output(name) for name in moved}
            moved.clear()
            if now != before and not rst:
                for name in (n for n in now if now[n] != before[n]):
                    kind = MAP[name].kind
                    assert not (busy and kind in (Kind.SETTING, Kind.STILL)), f"{name} changed inside a sample"
                    assert not (busy and kind is Kind.SAMPLE_PULSE and now[name]), f"{name} rose inside a sample"
            assert not (now["clear_trip"] and clear_trip_was), "clear_trip longer than a clock"
            if busy and not was_busy and taken:
                assert rst or not now["clear_faults"], "clear_faults stayed although a sample took it"
            clear_trip_was = now["clear_trip"]
            # sample_busy is up from the clock after the edge at which a sample took what was there before that
            was_busy, taken = busy, before["clear_faults"]
            # Inputs change at falling edges, in tasks that may run after this one: the next edge reads what it sees.
            before = now

    async def watch_responses(self) -> None:
        """A response stays as it is until it is taken, and only then ends."""
        dut = self.dut
        waiting = {}
        while True:
            await RisingEdge(dut.clk)
            for channel, (valid, ready, payload) in CHANNELS.items():
                seen = [str(getattr(dut, name).value) for name in payload]
                if channel in waiting:
                    assert str(getattr(dut, valid).value) == "1", f"{valid} fell before {ready}"
                    assert seen == waiting[channel], f"{payload} changed before {ready}"
                waits = str(getattr(dut, valid).value) == "1" and str(getattr(dut, ready).value) == "0"
                waiting.pop(channel, None)
                if waits and str(dut.rst.value) == "0":
                    waiting[channel] = seen

    async def samples(self, shortest_gap: int) -> None:
        """sample_busy as the top makes it, gaps of any length from the shortest on."""
        while True:
            taken = int(self.dut.clear_faults_in.value)
            await FallingEdge(self.dut.clk)  # the edge at which the sample came was before it
            self.dut.sample_busy.value = 1
            for _ in range(SAMPLE_INTERVAL - 1):
                await FallingEdge(self.dut.clk)
            if taken:
                self.twin.sample()
            self.dut.sample_busy.value = 0
            for _ in range(self.rng.choice((shortest_gap, shortest_gap + 1, 7, 30, 120))):
                await FallingEdge(self.dut.clk)

    def some_word(self, register) -> int:
        """A word near an end of the range, inside it, or anything."""
        low, high = register.port.low, register.port.high
        inside = self.rng.randint(low, high)
        near = self.rng.choice((low - 1, low, low + 1, high - 1, high, high + 1, 0, -1))
        return to_word(self.rng.choice((inside, near, self.rng.getrandbits(32))))
