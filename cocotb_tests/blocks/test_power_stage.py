# SPDX-License-Identifier: BSD-3-Clause
"""The asynchronous path from the trip pin to the gates: any time, any pulse length, with and without a clock."""

import json

import pytest

from fluxproof.cosim import ghdl


@pytest.mark.parametrize("levels", [(1, 1, 1), (0, 0, 0), (0, 1, 1), (1, 0, 0)])
def test_power_stage(levels):
    """``levels`` of gates, trip and brake at which they are active."""
    generics = dict(zip(("GATE_ACTIVE", "TRIP_ACTIVE", "BRAKE_ACTIVE"), levels, strict=True))
    environment = {"ACTIVE_LEVELS": json.dumps(levels)}
    folder = ghdl.run("power_stage", "cocotb_tests.support.in_simulator.dut_power_stage", generics, environment)
    problem = ghdl.failure(folder)
    assert problem is None, problem
