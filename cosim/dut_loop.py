"""The closed loop inside GHDL: runs one scenario and leaves the result in the folder of the run."""

from __future__ import annotations

import json
import os
import time

import cocotb
import numpy as np

from fluxproof.cosim.closed_loop import Result, cosimulate
from fluxproof.cosim.ghdl_device import GhdlDevice
from fluxproof.cosim.scenarios import SCENARIOS
from fluxproof.golden_model import drive as drives
from fluxproof.golden_model.registers import registers


def progress(done: int, total: int) -> None:
    """One line every now and then, for whoever watches (flushed: the simulator buffers)."""
    if done % max(1, total // 50) == 0 or done == total:
        with open("progress", "w") as stream:
            stream.write(f"{done} {total}")


def leave(result: Result, seconds: float) -> None:
    """Write result.npz and summary.json into the folder of the run; AssertionError where anything differs."""
    np.savez(
        "result.npz",
        **{f"observed_{k}": v for k, v in result.observed.items()},
        **{f"plant_{k}": v for k, v in result.plant.items()},
        gate_edges=result.gate_edges,
    )
    summary = {
        "periods_compared": result.periods_compared,
        "differences": result.differences,
        "first_difference": result.first_difference,
        "sample_to_duty_clocks": result.sample_to_duty_clocks,
        "gate_edges": len(result.gate_edges),
        "seconds": round(seconds, 2),
    }
    with open("summary.json", "w") as stream:
        json.dump(summary, stream)
    assert result.differences == 0, result.first_difference


@cocotb.test()
async def closed_loop(dut):
    drive = drives.load(os.environ["FLUXPROOF_DRIVE"])
    drive = drives.with_carrier(drive, int(os.environ["FLUXPROOF_CARRIER_HALF"]))
    register_set = registers(drive)
    scenario = SCENARIOS[os.environ["FLUXPROOF_SCENARIO"]](drive)
    began = time.monotonic()
    result = await cosimulate(GhdlDevice(dut), drive, register_set, scenario, progress)
    leave(result, time.monotonic() - began)
