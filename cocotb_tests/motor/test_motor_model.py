# SPDX-License-Identifier: BSD-3-Clause
"""The motor of the FPGA as it is wired against its golden model, and that model against the plant."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.cosim import sleeping
from fluxproof.hil.registers import PORTS, code, machine_of, motor_registers, motor_scale
from fluxproof.plant.pmsm import Machine
from golden_model.motor.motor_model import Shown
from studies.hil import closed_loop, equal, golden
from studies.hil.beside_plant import HELD, OWN, beside_plant
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


@pytest.mark.slow
def test_core_and_motor_in_one():
    """The loop closed in the RTL alone: gates at every clock, the last sample's values, a load step in the middle."""
    skip_without_ghdl5()
    golden, rtl = closed_loop.compare(40)
    wrong = np.flatnonzero(golden.words != rtl.words)
    assert not len(wrong), f"gates differ at clock {wrong[0]}"
    assert rtl.observed[-1] == golden.observed[-1]
    assert golden.observed[-1]["omega_me"] > 1000, "the shaft does not turn"


@pytest.mark.slow
@pytest.mark.parametrize(("all_clocks", "exact"), [(sleeping.EVERY_CLOCK, True), (("charge", "gates", "host"), False)])
def test_nothing_changes_in_what_sleeps(monkeypatch, all_clocks, exact):
    """Every register of the core that sleeps between samples, at every clock from the reset; a watchdog must not."""
    skip_without_ghdl5()
    monkeypatch.setattr(sleeping, "EVERY_CLOCK", all_clocks)
    core = closed_loop.rtl_of(closed_loop.parts(), sleeping.with_witness)
    core.tick(60_000)
    assert (core.missed == 0) == exact and core.get("running")


@pytest.mark.slow
def test_compiled_loop_is_the_clocked_one():
    """Core and motor in one compiled loop: every value of every sample as clock by clock, with a held shaft."""
    of, periods = closed_loop.parts(), 40
    turns = 100.0 * of.scale.step_s / (2 * np.pi)
    speed = code("omega_set", turns, PORTS["omega_set"].fmt)
    of = of._replace(motor=of.motor._replace(hold=1, omega_set=speed))
    clocked = closed_loop.golden_run(of, periods, 1 << 40).observed
    asked = np.array([[*closed_loop.references(of).values(), 0]] * periods, np.int64)
    u_dc = of.scale.u_dc(of.drive.inverter.dc_bus_v)
    hil = golden.Hil(of.core.values, of.core.config, of.motor, of.tables, of.sensors, u_dc)
    _, observed = golden.record(hil, asked, golden.constant(of.motor, periods))
    for k, row in enumerate(clocked):
        assert row == {name: int(values[k]) for name, values in observed.items()}, f"sample {k}"
    assert len(clocked) == periods - 1 and abs(clocked[-1]["omega_me"]) > 1000


@pytest.mark.parametrize("how", [HELD, OWN])
def test_motor_is_the_plant(how):
    """A tenth of a second of the ride with 2 us of dead time; the whole one: `make hil`."""
    drive = servo()
    off = differences(beside_plant(drive, ride(drive, 0.1), how))
    # Ramps and steps are most of so short a ride: twice what is asked of the whole.
    limits = {"current": CURRENT_PERCENT, "torque": TORQUE_PERCENT, "angle": ANGLE_DEG}
    assert all(off[name] < 2 * limit for name, limit in limits.items()), off


def test_registers_say_what_the_machine_is():
    """Each constant within a few 1e-5 of what was given; one that does not fit is refused by its name."""
    scale = motor_scale(SERVO, U_DC_V, CURRENT_A, CLOCK_HZ)
    got = machine_of(scale, motor_registers(scale, SERVO, SWITCHES), SERVO, SWITCHES)
    for name in ("resistance_ohm", "inductance_d_h", "inductance_q_h", "magnet_flux_wb", "inertia_kgm2"):
        assert getattr(got, name) == pytest.approx(getattr(SERVO, name), rel=5e-5), name
    light = Machine(**(vars(SERVO) | {"inertia_kgm2": 1e-12}))
    with pytest.raises(ValueError, match=r"motor: k_j = .* does not fit U\(-31,56\)"):
        motor_registers(scale, light, SWITCHES)
