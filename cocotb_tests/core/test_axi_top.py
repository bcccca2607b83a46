# SPDX-License-Identifier: BSD-3-Clause
"""The AXI top as software and power stage see it: closed loop over registers, pins and stream, equal in every bit."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from fluxproof.checkout import ROOT
from fluxproof.cosim import ghdl

CARRIER_HALF, CLOCK_HZ = 72, 1_440_000


@pytest.mark.slow
def test_motor_spins_over_the_registers():
    generics = {"CARRIER_HALF": CARRIER_HALF, "CLOCK_HZ": CLOCK_HZ}
    environment = {
        "FLUXPROOF_DRIVE": str(PAPER),
        "FLUXPROOF_CARRIER_HALF": str(CARRIER_HALF),
        "FLUXPROOF_CLOCK_HZ": str(CLOCK_HZ),
    }
    folder = ghdl.run("fluxproof_axi", "cocotb_tests.support.in_simulator.dut_axi_loop", generics, environment)
    problem = ghdl.failure(folder)
    assert problem is None, problem
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["periods"] == 200 and summary["gate_edges"] > 1500
    assert summary["packets"] + summary["dropped"] == 200 and summary["packets"] > 150
    assert summary["polled"] > 40
    # A model of nonsense could be bit-exact too: the motor must have turned.
    motion = np.load(folder / "result.npz")
    assert motion["omega_m"].max() > 15 and motion["omega_m"][-1] < motion["omega_m"].max() - 10


def test_the_golden_top_is_the_golden_core_a_clock_later():
    """The model that `make rough` and `make mutate` hold against fluxproof_axi; without numba, which takes longer."""
    command = [sys.executable, "-m", "cocotb_tests.support.core.axi_beside_core", "350"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["different"] == told["on_after"] == 0 and told["on_before"] > 100
