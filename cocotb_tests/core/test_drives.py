"""Every drive file of docs/drives: simulated to a verdict; the newer ones in closed loop, RTL against golden model."""

from __future__ import annotations

import pytest

from fluxproof.checkout import DRIVES
from fluxproof.cosim.runs import InGhdl, Named
from fluxproof.golden_model.drive import load

NAMES = ("servo_24v", "hub_36v", "spindle_400v", "drone_24v")


@pytest.mark.study
@pytest.mark.parametrize("name", NAMES)
def test_rtl_equals_golden_in_closed_loop(name):
    """400 periods of the VHDL in GHDL with the plant of the drive: start, load, bus sag, torque mode, reversal, off."""
    path = DRIVES / f"{name}.toml"
    job = InGhdl(f"test drive {name}", Named("fluxproof.cosim.runs:closed_loop", (str(path), 100, "tour")))
    job.carry_out()
    assert job.problem is None, job.problem
    summary, arrays = job.summary(), job.arrays()
    assert summary["differences"] == 0 and summary["periods_compared"] == 400
    assert not arrays["observed_sample_trip"].any() and arrays["observed_sat_q"].any()
    assert abs(arrays["plant_omega_m"]).max() > 0.2 * load(path).machine.rated_speed_rad_s
