# SPDX-License-Identifier: BSD-3-Clause
"""The asynchronous path from the trip pin to the gates: any time, any pulse length, with and without a clock."""

import json

import pytest

from fluxproof.cosim import ghdl


@pytest.mark.parametrize(
    ("levels", "clocks"),
    [((1, 1, 1), 0), ((0, 0, 0), 0), ((0, 1, 1), 0), ((1, 0, 0), 0), ((1, 0, 1), 5), ((0, 1, 0), 2)],
)
def test_power_stage(levels, clocks):
    """``levels`` of gates, trip and brake at which they are active; ``clocks`` of the filter of trip."""
    generics = dict(zip(("GATE_ACTIVE", "TRIP_ACTIVE", "BRAKE_ACTIVE"), levels, strict=True)) | {"TRIP_FILTER": clocks}
    environment = {"ACTIVE_LEVELS": json.dumps(levels), "TRIP_FILTER": str(clocks)}
    folder = ghdl.run("power_stage", "cocotb_tests.support.in_simulator.dut_power_stage", generics, environment)
    problem = ghdl.failure(folder)
    assert problem is None, problem
