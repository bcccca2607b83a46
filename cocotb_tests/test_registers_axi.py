"""The registers on the bus: the VHDL against its twin, and what else comes from the SystemRDL."""

from __future__ import annotations

from cocotb_tests import simulate
from scripts.registers import rdl

GENERICS = {"ADC_BITS": 14, "POSITION_BITS": 17, "CARRIER_HALF": 1234, "CLOCK_HZ": 125_000_000}


def test_axi_slave_equals_its_twin():
    """Every register, refusals, random traffic with back-pressure, resets: see dut_registers.py."""
    environment = {"FLUXPROOF_VERSION": str(rdl.version_word())}
    folder = simulate.run("register_file", "cocotb_tests.dut_registers", GENERICS, environment)
    problem = simulate.failure(folder)
    assert problem is None, problem
