# SPDX-License-Identifier: BSD-3-Clause
"""The asynchronous path from the trip pin to the gates: any time, any pulse length, with and without a clock."""

from fluxproof.cosim import ghdl


def test_power_stage():
    folder = ghdl.run("power_stage", "cocotb_tests.support.in_simulator.dut_power_stage", {}, {})
    problem = ghdl.failure(folder)
    assert problem is None, problem
