# SPDX-License-Identifier: BSD-3-Clause
"""Over-modulation: the fundamental of a clamped vector, the loop beyond the circle, the RTL beside the golden core."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fluxproof.checkout import DRIVES
from golden_model import torque_table
from golden_model.drive import DriveError, load
from golden_model.formats import DUTY_ONE
from golden_model.modulation import overmodulation, svm
from studies.speed import figures
from studies.speed.drives import over_the_hexagon, overmodulated
from studies.speed.overmodulation import built, settled_run


@pytest.mark.parametrize("length", [0.9, 1.0, 1.08, 1.1547, 1.5, 3.0, 8.0])
def test_fundamental_of_a_clamped_vector(length):
    """A turn of the modulator itself: its mean in the turning frame is F(R), which the table's gain inverts."""
    inverse, total, turn = 131072, 0.0, np.arange(720) * 2.0 * np.pi / 720
    for angle in turn:
        u = 65536 * length / np.sqrt(3.0) * np.exp(1j * angle) / 4.0  # an inverse of four bus voltages
        duties = svm.step(round(u.real), round(u.imag), 4 * inverse, round(4 * inverse * np.sqrt(0.75)))
        legs = np.asarray(duties) / DUTY_ONE
        vector = 2.0 / 3.0 * (legs @ np.exp(2j * np.pi / 3.0 * np.arange(3)))
        total += (vector * np.exp(-1j * angle)).real / len(turn)
    assert total * np.sqrt(3.0) == pytest.approx(overmodulation.fundamental(length), abs=4e-4)
    part = min(overmodulation.fundamental(length), overmodulation.MOST)
    assert overmodulation.gain_of(part**2 / 3.0) * part == pytest.approx(length, rel=1e-4)


def test_twice_base_speed_beyond_the_circle():
    """Surface machine: more torque than the circle allows, the fundamental asked for, current at its reference."""
    case = next(c for c in figures.cases() if c.name == "surface")
    plane = torque_table.Plane(case.truth, case.drive.machine.pole_pairs, case.drive.current_limit_a)
    speed = 2.0 * figures.base_speed(case, plane)
    found = settled_run(built(case), plane.most(np.inf)[0], speed, 0.2)
    assert found["torque"] > 1.05 * figures.possible(case, plane, speed)
    assert found["fundamental"] == pytest.approx(0.98 * 1.1, rel=0.005)
    assert found["error"] < 0.01 and found["peak"] < 1.2 and not found["trips"]


def test_what_is_refused():
    """Beyond the circle without the blocks, without the estimators, with currents of the lower legs."""
    drive = load(DRIVES / "paper001.toml")
    with pytest.raises(DriveError, match="voltage_fundamental"):
        dataclasses.replace(drive, control=dataclasses.replace(drive.control, voltage_fundamental=1.05))
    built_in = overmodulated(drive)
    with pytest.raises(DriveError, match="estimators"):
        dataclasses.replace(built_in, core=dataclasses.replace(built_in.core, estimators=False))
    with pytest.raises(DriveError, match="voltage_fundamental"):
        overmodulated(load(DRIVES / "servo_24v.toml"))


@pytest.mark.slow
def test_rtl_over_the_hexagon():
    """The RTL in Verilator equals the golden core below, at and beyond the circle, through a bus sag and a stop."""
    from fluxproof.cosim.runs import InVerilator, Named

    job = InVerilator("test_over_the_hexagon", Named("studies.speed.drives:over_the_hexagon", (128, 600)))
    job.carry_out()
    assert job.problem is None and job.summary()["periods_compared"] == len(over_the_hexagon(128, 600))
