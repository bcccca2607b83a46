# SPDX-License-Identifier: BSD-3-Clause
"""The fault sequence inside GHDL: the VHDL gets the inputs of the golden core clock by clock; outputs are compared."""

from __future__ import annotations

import json

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from fluxproof.cosim.block_bench import read
from fluxproof.cosim.golden_clock import SEEN
from golden_model.io import sample_latch
from studies.faults.bench import run, setup
from studies.faults.cases import tour
from studies.faults.cores import GoldenCore

CARRIER_HALF = 64


@cocotb.test()
async def fault_tour(dut):
    drive, register_set = setup(CARRIER_HALF)
    golden = GoldenCore(register_set)
    wanted = run(tour(), golden, drive, register_set).seen.tolist()
    handles = {name: getattr(dut, name) for name in SEEN}
    names = [p.name for p in sample_latch.BLOCK.inputs if p.name != "run_in"]
    for name in (*names, "sample_valid", "enable", "trip", "clear_trip", "host_write"):
        getattr(dut, name).value = 0
    for name, value in register_set.values._asdict().items():
        getattr(dut, name).value = value
    dut.rst.value = 1
    Clock(dut.clk, 10, unit="ns").start()
    for _ in range(4):
        await FallingEdge(dut.clk)
    dut.rst.value = 0
    for clock, (writes, row) in enumerate(zip(golden.writes, wanted, strict=True)):
        for name, value in writes.items():
            getattr(dut, name).value = value
        await FallingEdge(dut.clk)
        for (name, handle), value in zip(handles.items(), row, strict=True):
            got = read(handle, False)
            assert got == value, f"clock {clock}: {name}: got {got}, wanted {value}"
    with open("summary.json", "w") as stream:
        json.dump(
            {"clocks": len(wanted), "faults": sorted({row[SEEN.index("fault_flags")] for row in wanted})},
            stream,
        )
