# SPDX-License-Identifier: BSD-3-Clause
"""Voltage mode and changes between modes: no step, nothing changed within a mode; the RTL beside the golden core."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from golden_model.fluxproof import REGISTERS
from golden_model.registers import registers
from golden_model.units import to_si
from studies.position import figures, modes
from studies.position.drives import moves, positioned

DRIVE = modes.with_modes(figures.case("paper001"))
CIRCLE = DRIVE.inverter.dc_bus_v / np.sqrt(3.0)


def step_of(drive, before, after):
    """Largest step of the voltage at a change, of the circle."""
    scenario, values, at = modes.change(drive, before, after)
    run = figures.play(drive, scenario, **values)
    assert not np.any(run.observed["sample_trip"])
    return modes.step_of(drive, run.observed, at)


@pytest.mark.parametrize(
    "pair", [("voltage", "torque"), ("voltage", "speed"), ("torque", "voltage"), ("torque", "speed")]
)
def test_a_change_makes_no_step_of_the_voltage(pair):
    """Under half the rated load, with references that are far from what is there."""
    assert step_of(DRIVE, *pair) < modes.TARGET


def test_a_current_beyond_its_limit_does_not_spoil_the_flux():
    """A host that leaves the rotational voltage out drives i_d over the limit; torque mode brings it back."""
    scenario, values, at = modes.change(DRIVE, "voltage", "torque", rotates=False)
    observed = figures.play(DRIVE, scenario, **values).observed
    size = np.hypot(*(to_si(f"i_{x}", np.asarray(observed[f"i_{x}"]), DRIVE) for x in "dq"))
    wrong = np.hypot(*(to_si(f"delta_lambda_{x}", np.asarray(observed[f"delta_lambda_{x}"]), DRIVE) for x in "dq"))
    assert size[at] > DRIVE.current_limit_a > size[at + 60]
    assert wrong[at : at + 20].max() < 0.05 * DRIVE.machine.magnet_flux_wb


def test_without_the_block_a_change_makes_a_step():
    """The scene would show it: torque to speed mode with a speed error of a tenth."""
    assert step_of(modes.with_modes(DRIVE, False), "torque", "speed") > 0.1


def test_the_slowest_change_of_modes_ends():
    """A step of zero would leave the reference of the mode before for good: neither drive file nor bus can set one."""
    slow = dataclasses.replace(DRIVE, control=dataclasses.replace(DRIVE.control, mode_change_s=1e6))
    for name in ("u_step", "i_step", "omega_step"):
        assert getattr(registers(slow).values, name) == REGISTERS[name].low == 1


def test_within_a_mode_every_bit_is_as_without_the_block():
    """Steps of the torque, no change of modes."""
    chosen = registers(DRIVE)
    plain = chosen._replace(config=chosen.config._replace(modes=0))
    scenario = moves(DRIVE, 0.03, {})
    torque = np.where(np.arange(len(scenario)) % 100 < 50, 20000, -9000)
    scenario = dataclasses.replace(scenario, i_q_ext=torque, changes={})
    one, other = (figures.simulate(DRIVE, s, scenario).observed for s in (chosen, plain))
    assert all(np.array_equal(one[name], other[name]) for name in one)


def test_voltage_mode_gives_the_voltage_within_the_circle():
    """From zero by u_step a sample to the voltage asked for; one beyond the circle is cut."""
    drive = modes.with_modes(positioned("paper001"))
    chosen = registers(drive).values
    n, target = 800, 20000
    changes = {0: {"voltage_mode": 1, "u_q_ext": target}, n // 2: {"u_q_ext": 131071}}
    scenario = dataclasses.replace(moves(drive, n * drive.sample_time_s, {}), changes=changes)
    observed = figures.play(drive, scenario, compensate=0).observed
    asked = np.minimum(np.arange(n // 2) * chosen.u_step, target)
    assert np.array_equal(np.asarray(observed["u_q"])[: n // 2], asked)
    size = np.hypot(*(np.asarray(observed[f"u_{x}"], float) for x in "dq"))
    assert size[n // 2 :].max() == pytest.approx(np.asarray(observed["u_max"])[-1], abs=2.0)
    assert to_si("u_q", np.asarray(observed["u_q"])[-1], drive) == pytest.approx(CIRCLE, rel=0.01)


@pytest.mark.slow
def test_rtl_through_every_change():
    """The RTL in Verilator equals the golden core through every mode after every other, and stops of the gates."""
    from fluxproof.cosim.runs import InVerilator, Named

    job = InVerilator("test_every_change", Named("studies.position.modes:every_change", (128, 1300)))
    job.carry_out()
    assert job.problem is None and job.summary()["periods_compared"] == len(modes.every_change(128, 1300))
