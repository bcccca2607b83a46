# SPDX-License-Identifier: BSD-3-Clause
"""Runs inside the simulator: applies a stimulus file to any clocked entity and writes what every clock shows.

The file is JSON.  ``clock``: its name; ``inputs``: names, all 0 at first; ``outputs``: name -> whether it is
signed; ``writes``: for each clock the inputs that change before its rising edge, name -> integer.  The result is
JSON too: for each clock the outputs after its rising edge, in order, None for one with a bit that is neither 0 nor 1.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge


def integer(handle, signed: bool) -> int | None:
    """The port's value, or None where a bit is undefined."""
    bits = str(handle.value)
    if bits.strip("01"):
        return None
    return int(bits, 2) - (1 << len(bits) if signed and bits[0] == "1" else 0)


@cocotb.test()
async def trace(dut):
    stimulus = json.loads(Path(os.environ["FLUXPROOF_STIMULUS"]).read_text())
    outputs = [(getattr(dut, name), signed) for name, signed in stimulus["outputs"].items()]
    for name in stimulus["inputs"]:
        getattr(dut, name).value = 0
    clock = getattr(dut, stimulus["clock"])
    Clock(clock, 10, unit="ns").start(start_high=False)
    rows = []
    for writes in stimulus["writes"]:
        for name, value in writes.items():
            getattr(dut, name).value = value
        await FallingEdge(clock)
        rows.append([integer(handle, signed) for handle, signed in outputs])
    Path(os.environ["FLUXPROOF_TRACE"]).write_text(json.dumps(rows))
