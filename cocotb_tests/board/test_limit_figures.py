# SPDX-License-Identifier: BSD-3-Clause
"""The four runs of a drive that is set up wrongly: each ends in a named fault, or within the limit of the current."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.core.limits import DRIVE, QUARTER, SET, first, play, told
from golden_model.units import from_si


@pytest.mark.study
def test_wrong_angle(figure):
    """As in the limits' test: 99 degrees off, because exactly 90 degrees off there is no torque at all."""
    offset = (SET.values.theta_offset + round(1.1 * QUARTER)) % (4 * QUARTER)
    result = play(1300, 300.0, changes={"theta_offset": offset})
    named = ", ".join(first(result))
    figure("rotor angle wrong, +300 rpm: first fault", named, "runaway", "fault", named == "runaway")
    assert named == "runaway" and not result.running[-1]


@pytest.mark.study
def test_torque_mode_without_load(figure):
    result = play(2000, i_q=1.0, start_rpm=3500.0)
    named = ", ".join(first(result))
    figure("torque mode, 1 A, no load: first fault", named, "overspeed", "fault", named == "overspeed")
    speed = np.abs(result.observed["omega_me"])
    beyond = int(np.flatnonzero(speed >= (SET.values.omega_trip << 8) + 1)[0])
    late = sum(result.running[beyond:])
    figure("overspeed: samples until the gates are off", int(late), "<= 2", "samples", late <= 2)
    assert named == "overspeed"


@pytest.mark.study
def test_d_current_beyond_the_limit(figure):
    limit = from_si("i_d_ref", 7.1, DRIVE)
    result = play(1000, 600.0, i_d=12.0, changes={"i_max": limit, "i_trip": 511})
    size = float(np.hypot(result.plant["i_d"], result.plant["i_q"])[300:].mean())
    figure("i_d_ref of 12 A with a limit of 7.1 A: mean current", round(size, 2), "<= 7.17", "A", size <= 7.17)
    assert told(result) == []


@pytest.mark.study
def test_offset_of_a_sensor(figure):
    wrong = {"offset_a": SET.values.offset_a + round(0.1 / 12.5 * 32768)}
    result = play(120, 300.0, changes=wrong, off=80)
    named = ", ".join(first(result))
    figure("current offset of 0.1 A: first fault", named, "current_offset", "fault", named == "current_offset")
    assert named == "current_offset"
