# SPDX-License-Identifier: BSD-3-Clause
"""Inside the simulator: an incremental encoder's pins from its model, the outputs against the golden model's."""

from __future__ import annotations

import os
from itertools import islice

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from cocotb_tests.support.peripherals.golden_player import GoldenPlayer
from cocotb_tests.support.peripherals.incremental_stimulus import BITS, incremental
from fluxproof.cosim.block_bench import read
from golden_model.encoders import incremental_encoder

CLOCKS, CHUNKS = 6000, 3


@cocotb.test()
async def follows_the_model(dut):
    golden = GoldenPlayer(incremental_encoder.BLOCK, {"POSITION_BITS": BITS}, {})
    outputs = [(p.name, getattr(dut, p.name), bool(p.fmt.signed)) for p in incremental_encoder.BLOCK.outputs]
    for port in incremental_encoder.BLOCK.inputs + incremental_encoder.BLOCK.registers:
        getattr(dut, port.name).value = 0
    dut.rst.value = 1
    Clock(dut.clk, 10, unit="ns").start()
    for _ in range(3):
        await FallingEdge(dut.clk)
    dut.rst.value = 0
    for registers, inputs in islice(incremental(int(os.environ["FLUXPROOF_SEED"]), CLOCKS), CHUNKS):
        for name, value in registers.items():
            getattr(dut, name).value = value
        golden.registers = registers
        wanted = golden.play(inputs)
        columns = {name: values.tolist() for name, values in inputs.items()}
        driven = dict.fromkeys(columns)
        for k in range(CLOCKS):
            for name, values in columns.items():
                if values[k] != driven[name]:
                    driven[name] = values[k]
                    getattr(dut, name).value = values[k]
            await FallingEdge(dut.clk)
            got = {name: read(handle, signed) for name, handle, signed in outputs}
            wrong = {name: (value, int(wanted[name][k])) for name, value in got.items() if value != wanted[name][k]}
            assert not wrong, f"clock {k}: got, wanted {wrong}; {registers}"
