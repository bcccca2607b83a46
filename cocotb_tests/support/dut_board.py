"""Inside the simulator: fluxproof_board in the closed loop of board_loop, every pin at every clock against golden."""

from __future__ import annotations

import json
import os

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from cocotb_tests.support.board_loop import AXI, CONSTANT
from cocotb_tests.support.board_runs import RUNS, status
from fluxproof.cosim.block_bench import read
from fluxproof.cosim.board_clock import PINS, SEEN


@cocotb.test()
async def equals_the_golden_board(dut):
    loop = RUNS[os.environ["FLUXPROOF_RUN"]]()
    for name in (*PINS, *AXI, "s_axi_arvalid", "s_axi_araddr", "s_axi_awprot", "s_axi_arprot", "trip"):
        getattr(dut, name).value = 0
    for name, value in CONSTANT.items():
        getattr(dut, name).value = value
    dut.aresetn.value = 0
    Clock(dut.aclk, 10, unit="ns").start()
    for _ in range(6):
        await FallingEdge(dut.aclk)
    dut.aresetn.value = 1
    for _ in range(2):  # the reset inside is two clocks later
        await FallingEdge(dut.aclk)
    outputs = [getattr(dut, name) for name in SEEN]
    clocks, words = 0, []
    for chunk in loop.run(int(os.environ["FLUXPROOF_PERIODS"])):
        changes = [(getattr(dut, name), column.tolist()) for name, column in chunk.inputs.items()]
        driven = [None] * len(changes)
        for k, wanted in enumerate(chunk.seen.tolist()):
            for n, (handle, column) in enumerate(changes):
                if column[k] != driven[n]:
                    driven[n] = column[k]
                    handle.value = column[k]
            await FallingEdge(dut.aclk)
            got = [read(handle, False) for handle in outputs]
            if got != wanted:
                raise AssertionError(f"period {chunk.number}, clock {k}: {dict(zip(SEEN, zip(got, wanted)))}")
            clocks += 1
            if read(dut.m_axis_tvalid, False):
                words.append(read(dut.m_axis_tdata, False))
    facts = {"clocks": clocks, "samples": loop.golden.samples, "rpm": chunk.omega_m * 9.549, **status(chunk)}
    facts["fault_flags"] = loop.golden.state.of_core.of_fault_latch.flags
    np.array(words, "<u4").tofile("capture.bin")
    history = [(list(sample), list(observed)) for sample, observed in loop.golden.history]
    facts["history"] = [[list(map(int, row)) for row in pair] for pair in history]
    with open("board.json", "w") as file:
        json.dump(facts, file)
