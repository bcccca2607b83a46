# SPDX-License-Identifier: BSD-3-Clause
"""The motor of the FPGA as it is wired against its golden model, and that model against the plant."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.hil.beside_plant import HELD, OWN, beside_plant
from fluxproof.hil.registers import machine_of, motor_registers, motor_scale
from fluxproof.plant.pmsm import Machine
from golden_model.motor.motor_model import Shown
from studies.hil import equal
from studies.hil.drive import CLOCK_HZ, CURRENT_A, SERVO, SWITCHES, U_DC_V, ride, servo
from studies.hil.plant import ANGLE_DEG, CURRENT_PERCENT, TORQUE_PERCENT, differences


def test_motor_in_verilator():
    """Saturation, harmonics, cogging, friction, dead times, all gates off, a second start: every output, every step."""
    skip_without_ghdl5()
    done = equal.compare(3000)
    wrong = done.wrong
    assert not len(wrong), f"step {wrong[0][0]}: {Shown._fields[wrong[0][1]]} differs"
    assert (np.ptp(done.golden, axis=0) > 1000).all(), "an output that hardly moves shows nothing"
    assert not done.shoot_through.any()


@pytest.mark.parametrize("how", [HELD, OWN])
def test_motor_is_the_plant(how):
    """A tenth of a second of the ride with 2 us of dead time; the whole one: `make hil`."""
    drive = servo()
    off = differences(beside_plant(drive, ride(drive, 0.1), how))
    # The ramps are a fifth of the ride and not a hundredth: twice what is asked of the whole.
    assert off["current"] < 2 * CURRENT_PERCENT and off["torque"] < TORQUE_PERCENT and off["angle"] < ANGLE_DEG, off


def test_registers_say_what_the_machine_is():
    """Each constant within a few 1e-5 of what was given; one that does not fit is refused by its name."""
    scale = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ)
    got = machine_of(scale, motor_registers(scale, SERVO, SWITCHES), SERVO, SWITCHES)
    for name in ("resistance_ohm", "inductance_d_h", "inductance_q_h", "magnet_flux_wb", "inertia_kgm2"):
        assert getattr(got, name) == pytest.approx(getattr(SERVO, name), rel=5e-5), name
    light = Machine(**(vars(SERVO) | {"inertia_kgm2": 1e-12}))
    with pytest.raises(ValueError, match=r"motor: k_j = .* does not fit U\(-31,56\)"):
        motor_registers(scale, light, SWITCHES)
