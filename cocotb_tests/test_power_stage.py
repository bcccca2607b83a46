"""The trip pin and the gates' last registers, as no model with a clock can tell it: any time, any length, no clock."""

from cocotb_tests import simulate


def test_power_stage():
    folder = simulate.run("power_stage", "cocotb_tests.dut_power_stage", {}, {})
    problem = simulate.failure(folder)
    assert problem is None, problem
