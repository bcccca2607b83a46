"""Long closed loops at the full 200 MHz / 10 kHz ratio: the converted RTL, compiled, equal to the golden model."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from cocotb_tests.simulate import ROOT
from golden_model import drive as drives
from golden_model.registers import registers
from scripts import verilog
from scripts.cosim import cosimulate, run_now
from scripts.scenarios import SCENARIOS

DRIVE = drives.load(ROOT / "docs" / "drives" / "paper001.toml")


def ghdl5_missing() -> str | None:
    """Why the conversion cannot run here, or None."""
    try:
        verilog.find_ghdl()
    except RuntimeError as error:
        return str(error)
    return None if shutil.which("g++") else "g++ is not installed"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fig9", "full_speed"])
def test_full_ratio(name):
    reason = ghdl5_missing()
    if reason:
        pytest.skip(reason)
    from scripts.verilated_device import VerilatedDevice

    register_set = registers(DRIVE)
    assert register_set.config.carrier_half == 10_000
    result = run_now(
        cosimulate(VerilatedDevice(register_set.config), DRIVE, register_set, SCENARIOS[name](DRIVE))
    )
    assert result.differences == 0, result.first_difference
    assert result.periods_compared >= 3000
    assert result.sample_to_duty_clocks == 38
    rpm = result.plant["omega_m"] * 30 / np.pi
    if name == "fig9":
        assert abs(rpm[-1] - 732) < 15 and rpm[1750] == pytest.approx(732, abs=15)
    else:
        assert rpm.max() > 2000 and rpm.min() < -1000
        assert np.count_nonzero(result.observed["sat_q"]) > 200, "the voltage circle was never reached"
