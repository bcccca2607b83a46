"""A key experiment of the papers inside GHDL; leaves the result in the folder of the run."""

from __future__ import annotations

import os
import time

import cocotb

from fluxproof.cosim.closed_loop import cosimulate
from fluxproof.cosim.dut_loop import leave, progress
from fluxproof.cosim.ghdl_device import GhdlDevice
from fluxproof.golden_model import drive as drives
from studies.papers.flux_bench import PAPER_DRIVE
from studies.papers.flux_rtl import runs


@cocotb.test()
async def experiment(dut):
    drive = drives.with_carrier(drives.load(PAPER_DRIVE), int(os.environ["FLUXPROOF_CARRIER_HALF"]))
    run = runs(drive)[os.environ["FLUXPROOF_EXPERIMENT"]]
    began = time.monotonic()
    device = GhdlDevice(dut)
    result = await cosimulate(
        device, drive, run.registers, run.scenario, progress, machine=run.machine, ideal_inverter=run.end is not None
    )
    leave(result, time.monotonic() - began)
