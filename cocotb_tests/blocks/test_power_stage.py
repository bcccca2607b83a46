"""The trip pin and the gates' last registers, as no model with a clock can tell it: any time, any length, no clock."""

from fluxproof.cosim import ghdl


def test_power_stage():
    folder = ghdl.run("power_stage", "cocotb_tests.support.dut_power_stage", {}, {})
    problem = ghdl.failure(folder)
    assert problem is None, problem
