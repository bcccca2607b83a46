# SPDX-License-Identifier: BSD-3-Clause
"""The one bench, the part that runs inside the simulator: drives the rows of a file and compares with ``==``."""

from __future__ import annotations

import gc
import os

import cocotb
from cocotb.clock import Clock as ClockDriver
from cocotb.triggers import FallingEdge, Timer, ValueChange

from fluxproof.cosim.bench_file import Bench, load

CLOCK_NS = 10


def read(handle, signed: bool) -> int | str:
    """The value as an integer, or as text where it holds anything but 0 and 1."""
    value = handle.value
    text = str(value)
    if text.strip("01"):
        return text
    number = int(text, 2)
    return number - (1 << len(text)) if signed and text[0] == "1" and len(text) > 1 else number


def report(bench: Bench, clock: int, sample: int, wrong) -> str:
    """Everything needed to understand a difference, and the line that brings it back."""
    driven = next((row.writes for row in bench.rows if row.sample == sample >= 0), {})
    inputs = ", ".join(f"{k}={v}" for k, v in driven.items())
    got = "; ".join(f"{name}: got {a}, wanted {b}" for name, a, b in wrong)
    return (
        f"{bench.title} differs from its model at sample {sample}, clock {clock}, seed {bench.seed}\n"
        f"  inputs: {inputs}\n  {got}\n"
        f"  rerun:  {bench.rerun}"
    )


class Silence:
    """Notices when an output that says that another one is due moves while nobody looks."""

    def __init__(self, handles):
        self.moved: list[str] = []
        for handle in handles:
            cocotb.start_soon(self._watch(handle))

    async def _watch(self, handle):
        while True:
            await ValueChange(handle)
            self.moved.append(handle._name)

    async def keep(self, clk, count: int) -> list[str]:
        """Wait for ``count`` falling edges; the names of what moved where there are clocks nobody looks at."""
        if count < 3:
            for _ in range(count):
                await FallingEdge(clk)
            return []
        self.moved.clear()
        await Timer(count * CLOCK_NS - CLOCK_NS // 2, "ns")  # the last rising edge before
        await FallingEdge(clk)
        return self.moved


@cocotb.test()
async def equals_model(dut):
    gc.disable()  # the rows are many, live as long as the run and would be searched again and again
    bench = load(os.environ["FLUXPROOF_BENCH"])
    inputs = {name: getattr(dut, name) for name in bench.inputs}
    outputs = [(name, getattr(dut, name), signed) for name, signed in bench.outputs]
    announced = {name: getattr(dut, name) for name in bench.strobes}

    for handle in inputs.values():
        handle.value = 0
    driven = dict.fromkeys(inputs, 0)  # cocotb takes longer to write a port than the simulator to run a clock
    if bench.has_rst:
        dut.rst.value = 1
    if bench.strobes:
        dut.in_valid.value = 0
    ClockDriver(dut.clk, CLOCK_NS, unit="ns").start()
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)

    silence = Silence(announced.values())
    compared, in_valid, rst, held = 0, 0, 1, None
    following = [row.number for row in bench.rows[1:]] + [bench.clocks]
    for row, following_number in zip(bench.rows, following, strict=True):
        wrong = [
            (name, value, wanted) for name, wanted in row.strobes if (value := read(announced[name], False)) != wanted
        ]
        if not wrong and (row.outputs or bench.atomic):
            seen = {name: read(handle, signed) for name, handle, signed in outputs}
            wrong = [(name, seen[name], wanted) for name, wanted in row.outputs if seen[name] != wanted]
            if row.still and seen != held:
                wrong += [("outputs without out_valid", seen, held)]
            held = seen
        if wrong:
            raise AssertionError(report(bench, row.number, row.of_sample, wrong))
        compared += row.due
        for name, value in row.writes.items():
            if driven[name] != value:
                driven[name] = value
                inputs[name].value = value
        if row.rst != rst and bench.has_rst:
            rst = row.rst
            dut.rst.value = rst
        if bench.strobes and row.in_valid != in_valid:
            in_valid = row.in_valid
            dut.in_valid.value = in_valid
        if moved := await silence.keep(dut.clk, following_number - row.number):
            wrong = [(name, "moved", f"still until clock {following_number}") for name in moved]
            raise AssertionError(report(bench, row.number, row.sample, wrong))
    cocotb.log.info("%d samples compared in %d clocks", compared, bench.clocks)
    assert compared > 100, "the schedule compared next to nothing"
