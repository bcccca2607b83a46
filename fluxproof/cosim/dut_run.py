# SPDX-License-Identifier: BSD-3-Clause
"""Inside GHDL: the run that FLUXPROOF_RUN names (cosim/runs.py), on the VHDL."""

from __future__ import annotations

import json
import os
from pathlib import Path

import cocotb

from fluxproof.cosim.ghdl_device import GhdlDevice
from fluxproof.cosim.runs import Named, carry_out


@cocotb.test()
async def run(dut):
    task = json.loads(os.environ["FLUXPROOF_RUN"])
    named = Named(task["function"], tuple(task["arguments"]))
    result = await carry_out(named.make(), GhdlDevice(dut), Path(task["folder"]))
    assert result.differences == 0, result.first_difference
