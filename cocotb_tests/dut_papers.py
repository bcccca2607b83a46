"""A key experiment of the papers inside GHDL; leaves the result in the folder of the run."""

from __future__ import annotations

import os
import time

import cocotb

from cocotb_tests.dut_loop import leave, progress
from cocotb_tests.ghdl_device import GhdlDevice
from golden_model import drive as drives
from scripts.cosim import cosimulate
from scripts.papers.flux_bench import PAPER_DRIVE
from scripts.papers.flux_rtl import runs


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
