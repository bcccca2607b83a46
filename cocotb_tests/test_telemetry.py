"""The telemetry stream end to end: core and stream in GHDL, capture, reader, dump, replay; and damaged captures."""

from __future__ import annotations

import os

import numpy as np
import pytest

from cocotb_tests import simulate
from cocotb_tests.telemetry_top import NAME, write_top
from golden_model import drive as drives
from golden_model.registers import registers

PAPER = simulate.ROOT / "docs" / "drives" / "paper001.toml"
CARRIER_HALF = 100
DEPTH_BITS = 7


def simulated():
    """The folder of a run of all of dut_telemetry, with its capture.bin and observed.npz."""
    drive = drives.with_carrier(drives.load(PAPER), CARRIER_HALF)
    generics = {name.upper(): value for name, value in registers(drive).config._asdict().items()}
    generics["DEPTH_BITS"] = DEPTH_BITS
    environment = {
        "FLUXPROOF_DRIVE": str(PAPER),
        "FLUXPROOF_CARRIER_HALF": str(CARRIER_HALF),
        "FLUXPROOF_DEPTH_BITS": str(DEPTH_BITS),
        "FLUXPROOF_SEED": os.environ.get("FLUXPROOF_SEED", "1"),
    }
    return simulate.run(NAME, "cocotb_tests.dut_telemetry", generics, environment, extra=[write_top()])


def test_stream():
    folder = simulated()
    problem = simulate.failure(folder)
    assert problem is None, problem
