# SPDX-License-Identifier: BSD-3-Clause
"""The position loop: trajectory within its limits, following error, rest, modes, and the RTL beside the golden core."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fluxproof.checkout import DRIVES
from golden_model import drive as drives
from golden_model.control import position_trajectory as trajectory
from golden_model.control.position_control import POSITION
from golden_model.control.position_plan import WAY
from golden_model.drive_keys import DriveError
from golden_model.motion import Position
from golden_model.registers import registers
from studies.position import figures
from studies.position.drives import all_modes, moves, positioned

POSITIONS = ("shaft_position", "position_error")
ONE = {name: 0 for name in trajectory.Registers._fields} | {"position_mode": 1}


def course(targets, samples, **values):
    """(way [turns] of every sample, last state) of a trajectory whose target changes every ``samples``."""
    state, rows = trajectory.State(), []
    for target in targets:
        regs = trajectory.Registers(**(ONE | values | {"position_target": target}))
        for _ in range(samples):
            state, out = trajectory.step(state, trajectory.Inputs(0, 0, 1), regs)
            rows.append((state.way * WAY.lsb, out[0]))
    return np.array(rows), state


@pytest.mark.parametrize("bits", [0, 2, 5])
def test_trajectory_keeps_its_limits_and_ends_at_the_target(bits):
    """Targets that change at rest and on the way: speed, acceleration and jerk as set, the end exact."""
    speed, step, samples = 1 << 26, (1 << 25) >> bits, 8 << bits
    long, short = [100000, -33333, 7, 8, 1 << 20], [400000, -400000, 5000, 5000, 5000]
    rows, _ = course(long, 5000, move_speed=speed, move_step=step, jerk_bits=bits, torque_lead=3)
    assert [int(rows[5000 * k - 1, 1]) for k in range(1, 6)] == long
    more, state = course(short, 1700, move_speed=speed, move_step=step, jerk_bits=bits)
    assert int(more[-1, 1]) == 5000 and state.ahead == state.v == state.a == 0
    for way in (rows[:, 0], more[:, 0]):
        v, tiny = np.diff(way, prepend=0.0), 1e-11
        most = speed * 2.0**-34
        acceleration = step * samples * 2.0**-WAY.frac_bits
        assert np.abs(v).max() <= most + tiny and np.abs(v).max() > 0.9 * most
        assert np.abs(np.diff(v)).max() <= acceleration + tiny
        assert np.abs(np.diff(v, 2)).max() <= 2.0 * acceleration / samples + tiny


def test_following_error_with_the_right_inertia():
    """Two counts of the encoder at most on the way; without what is fed forward more than a hundred."""
    drive = figures.case("servo_24v")
    scenario, _ = figures.there_and_back(drive)
    run = figures.play(drive, scenario)
    assert np.abs(figures.counts(drive, run.observed)).max() <= 2.0
    assert not np.any(run.observed["sample_trip"])
    plain = figures.play(drive, scenario, k_inertia=0, k_viscous=0, coulomb=0)
    assert np.abs(figures.counts(drive, plain.observed)).max() > 100.0


def test_a_shaft_without_friction_stays_within_a_count_of_4096():
    """Directions of the measured current, which is zero at rest, let it drift: 52 codes of 65,536 on this way."""
    drive = figures.case("paper001")
    run = figures.play(drive, figures.there_and_back(drive)[0])
    assert np.abs(figures.counts(drive, run.observed)).max() <= 16.0


def test_without_position_mode_every_bit_is_as_before():
    """position_loop with position_mode = 0 gives the outputs of a core without it, but for the position."""
    drive = positioned("paper001")
    chosen = registers(drive)
    scenario = moves(drive, 0.03, {})
    scenario.changes[0]["position_mode"] = 0
    scenario.i_q_ext[:] = 20000
    plain = chosen._replace(config=chosen.config._replace(position_loop=0))
    one, other = (figures.simulate(drive, s, scenario).observed for s in (chosen, plain))
    assert all(np.array_equal(one[name], other[name]) for name in one if name not in POSITIONS)
    assert one["shaft_position"].any() and not other["shaft_position"].any()


def test_moves_that_cannot_be_are_refused():
    with pytest.raises(DriveError, match="stop_low_rad"):
        positioned("paper001", stop_low_rad=1.0, stop_high_rad=-1.0)
    with pytest.raises(DriveError, match="stop_high_rad is not"):
        positioned("paper001", stop_low_rad=1.0)
    with pytest.raises(DriveError, match="position_loop is not true"):
        dataclasses.replace(drives.load(DRIVES / "paper001.toml"), position=Position(bandwidth_hz=5.0))
    with pytest.raises(DriveError, match=r"speed_rad_s = 400 .* below 376.8 rad/s, where the drive trips"):
        positioned("servo_24v", speed_rad_s=400.0)
    with pytest.raises(DriveError, match="jerk_rad_s3"):
        registers(positioned("paper001", jerk_rad_s3=1.0))
    assert not registers(drives.load(DRIVES / "paper001.toml")).values.k_inertia
    assert registers(positioned("paper001", stop_low_rad=-1.0, stop_high_rad=1.0)).values.stop_low < 0 < POSITION.hi


@pytest.mark.slow
def test_rtl_in_all_modes():
    """The RTL in Verilator equals the golden core through torque, speed and position mode and stops of the gates."""
    from fluxproof.cosim.runs import InVerilator, Named

    job = InVerilator("test_all_modes", Named("studies.position.drives:all_modes", (128, 1000)))
    job.carry_out()
    assert job.problem is None and job.summary()["periods_compared"] == len(all_modes(128, 1000))
