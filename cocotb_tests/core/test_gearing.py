# SPDX-License-Identifier: BSD-3-Clause
"""The gear to a second encoder: no drift, ratio and clutch, the trajectory that follows, stops, and the RTL."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from fluxproof.checkout import DRIVES
from fluxproof.diagnosis.replay.digital import _geared
from golden_model import drive as drives
from golden_model.control import gear
from golden_model.control import position_trajectory as trajectory
from golden_model.control.position_control import POSITION_W
from golden_model.drive_keys import DriveError
from golden_model.fixed import wrap_s
from golden_model.formats import TURN_W
from golden_model.kernel import kernel
from golden_model.motion import Position, gear_delay, gear_ratio
from golden_model.registers import registers
from studies.position import figures
from studies.position.drives import moves, positioned
from studies.position.gears import every_clutch, geared, turning, with_master

SPEED = 1300  # of the master, codes a sample
ON = gear.Registers(0, 1, 3, 7, 1 << 20, 0, 0)
MOVE = trajectory.Registers(**(dict.fromkeys(trajectory.Registers._fields, 0) | {
    "position_mode": 1, "move_speed": 1 << 26, "move_step": 1 << 25, "torque_lead": 3,
}))  # fmt: skip


def follow(codes, gears=lambda k: ON, move=lambda k: MOVE):
    """(way, position_ref of the same sample, engaged, stopped) of each sample of a master's ``codes``."""
    of_gear, state, free, at_stop, ref, rows = gear.State(), trajectory.State(), 1, 0, 0, []
    for k, code in enumerate(codes):
        regs = gears(k)._replace(gear_code=int(code) % (1 << TURN_W))
        of_gear, (way, led, engaged, stopped) = gear.step(of_gear, gear.Inputs(free, at_stop), regs)
        rows.append((way, ref, engaged, stopped))
        state, (ref, _, _, _, free, at_stop) = trajectory.step(state, trajectory.Inputs(0, led, 1), move(k))
    return np.array(rows).T


def test_way_and_rest_hold_all_that_the_master_turned():
    """way*denominator + rest = sum of delta*acting, modulo the turns of the counter: ratios of every size and sign."""
    rng = np.random.default_rng(51)
    for _ in range(40):
        top = int(2 ** rng.uniform(0, 15))
        numerator, denominator = int(rng.integers(-top, top)), int(2 ** rng.uniform(0, 16))
        state, total, code = gear.State(), 0, 0
        for _ in range(60):
            before, delta = state, int(rng.integers(-(1 << 17), 1 << 17)) >> int(rng.integers(18))
            code = (code + delta) % (1 << TURN_W)
            regs = gear.Registers(code, 1, numerator, denominator, int(rng.integers(1, 1 << 25)), 0, 0)
            state, _ = gear.step.py_func(state, gear.Inputs(0, 0), regs)
            total += delta * state.acting if before.seen else 0
            scale = denominator << gear.PART
            assert 0 <= state.rest < scale
            assert (state.way * scale + state.rest - total) % (scale << POSITION_W) == 0


@pytest.mark.slow
def test_ten_million_turns_leave_nothing():
    """The way after 10**7 turns of the master, and after all of them back, is the exact fraction of them."""

    @kernel
    def turned(state, code, samples, delta, regs):
        for _ in range(samples):
            code = (code + delta) & ((1 << TURN_W) - 1)
            now = gear.Registers(
                code, 1, regs.gear_numerator, regs.gear_denominator, regs.gear_step, regs.gear_lead, regs.gear_smooth
            )
            state, _ = gear.step(state, gear.Inputs(0, 0), now)
        return state, code

    delta, turns = (1 << 16) - 1, 10**7
    samples = turns * (1 << TURN_W) // delta
    state, _ = gear.step(gear.State(), gear.Inputs(0, 0), ON)
    state, code = turned(state, 0, samples, delta, ON._replace(gear_step=(1 << 25) - 1))
    exact = Fraction(samples * delta * ON.gear_numerator, ON.gear_denominator)
    assert state.way == wrap_s(exact.numerator // exact.denominator, POSITION_W)
    state, code = turned(state, code, samples, -delta, ON._replace(gear_step=(1 << 25) - 1))
    assert code == 0 and state.way == 0 and state.rest == 0


def test_the_reference_is_where_the_master_is():
    """At constant speed within two of 2**-18 turns with the lead of the drive file, late by gear_delay without."""
    drive = geared(positioned("paper001"))
    values = registers(drive).values
    ahead = ON._replace(gear_lead=values.gear_lead, gear_smooth=values.gear_smooth)
    moves_of = MOVE._replace(torque_lead=values.torque_lead)
    codes = np.arange(1500) * SPEED
    way, ref, engaged, _ = follow(codes, lambda k: ahead, lambda k: moves_of)
    late_way, late, _, _ = follow(codes, move=lambda k: moves_of)
    assert engaged[-1] and np.abs(way - ref)[-100:].max() <= 2
    assert np.abs(late_way - late - gear_delay(drive) * SPEED * 3 / 7)[-100:].max() <= 2


def test_the_clutch_gives_no_step():
    """In, another ratio, out: the reference's acceleration stays that of the numerator's ramp."""
    step = 8
    phases = [ON._replace(gear_on=0, gear_step=step), ON._replace(gear_step=step),
              ON._replace(gear_step=step, gear_numerator=-2), ON._replace(gear_step=step, gear_on=0)]  # fmt: skip
    way, ref, engaged, _ = follow(np.arange(1600) * SPEED, lambda k: phases[k // 400])
    acceleration = SPEED * step / (7 << gear.PART)
    assert np.abs(np.diff(ref, 2)).max() <= acceleration + 2.0
    assert [bool(engaged[400 * k + 399]) for k in range(4)] == [False, True, True, False]
    assert way[-1] == way[1400]


def test_own_moves_keep_their_limits_above_the_gear():
    """A shift of the phase while the master turns: the move keeps its own speed beside the gear and ends exactly."""
    shift = 30000
    moving = MOVE._replace(move_speed=1 << 23, move_step=1 << 23)
    targets = (moving, moving._replace(position_target=shift))
    way, ref, _, _ = follow(np.arange(2400) * SPEED, move=lambda k: targets[k >= 400])
    own = ref - way
    assert np.abs(np.diff(own[300:])).max() <= (1 << 23) / (1 << 16) + 2.0
    assert abs(int(own[-1] - own[399]) - shift) <= 1
    way, ref, _, _ = follow(
        np.arange(2400) * SPEED, move=lambda k: moving._replace(position_target=-shift * (k >= 400))
    )
    assert abs(int((ref - way)[-1] - (ref - way)[399]) + shift) <= 1


def test_a_stop_ends_the_gear_and_holds():
    """Beyond a soft end stop the gear ends, tells it until gear_on = 0, and the reference returns to the stop."""
    stops = MOVE._replace(use_stops=1, stop_low=-1000, stop_high=200000)
    codes, quick = np.arange(2500) * SPEED, ON._replace(gear_step=64)
    _, ref, engaged, stopped = follow(codes, lambda k: quick, lambda k: stops)
    assert stopped[-1] and not engaged[-1] and int(ref[-1]) == 200000
    first = int(np.argmax(stopped))
    assert 0 < first and engaged[first - 1] and stopped[first:].all() and ref.max() < 230000
    _, _, _, stopped = follow(codes, lambda k: quick._replace(gear_on=int(k < 2400)), lambda k: stops)
    assert stopped[2399] and not stopped[-1]


@pytest.mark.parametrize("pause, most", [(1, 10.0), (3, SPEED * 3 / 7 / 8 + 10.0), (100, 10.0)])
def test_the_gear_goes_on_after_a_break_of_position_mode(pause, most):
    """The reference begins at the shaft with no more acceleration than a move's; a long break is a new clutch.

    A break that the plan of a section sees, and that is over before the profile has the shaft's speed, costs a section.
    """
    codes, quick, off = np.arange(1200) * SPEED, ON._replace(gear_step=8), MOVE._replace(position_mode=0)
    way, ref, _, _ = follow(codes, lambda k: quick, lambda k: off if 600 <= k < 600 + pause else MOVE)
    assert np.abs(ref[601 : 600 + pause]).max(initial=0) < 1300 and (pause < 100 or way[690] == 0)
    assert np.abs(np.diff(ref[601 + pause :], 2)).max() <= most


def test_without_gear_on_every_bit_is_as_before():
    """A core with gearing whose gear is off, the master turning, gives the outputs of one without."""
    drive = geared(positioned("paper001"))
    scenario = moves(drive, 0.02, {0.002: 1.0})
    turns = turning(drive, 0.02, {0.0: 20.0}, 0.005)
    chosen = registers(drive)
    plain = chosen._replace(config=chosen.config._replace(gearing=0))
    one = figures.simulate(drive, chosen, with_master(scenario, turns, 4000)).observed
    other = figures.simulate(drive, plain, scenario).observed
    assert all(np.array_equal(one[name], other[name]) for name in one) and one["shaft_position"].any()


def test_keys_of_the_gear():
    drive = geared(positioned("paper001"), ratio=(-10, 4))
    assert gear_ratio(drive) == (-32765, 13106)
    values = registers(drive).values
    assert (values.gear_numerator, values.gear_denominator, values.gear_on) == (-32765, 13106, 0)
    assert values.gear_lead == gear_delay(drive) and 1 << values.gear_smooth >= values.gear_lead
    samples = drive.position.gear_ramp_s / drive.sample_time_s
    assert values.gear_step == round(32765 * (1 << gear.PART) / samples)
    plain = drives.load(DRIVES / "paper001.toml")
    assert registers(plain).values.gear_denominator == 1  # the reset value
    with pytest.raises(DriveError, match="gearing needs position_loop"):
        dataclasses.replace(plain, core=dataclasses.replace(plain.core, gearing=True))
    with pytest.raises(DriveError, match="gear_numerator is missing"):
        dataclasses.replace(drive, position=dataclasses.replace(drive.position, gear_numerator=None))
    with pytest.raises(DriveError, match="gearing is not true"):
        dataclasses.replace(positioned("paper001"), position=Position(gear_numerator=1))


def test_a_recording_without_the_masters_codes_is_not_replayed():
    on = {"config": {"gearing": 1}, "registers": {"gear_on": 1, "position_mode": 1}}
    assert _geared(on) and _geared(on | {"changes": [(7, {"kp_d": 3})]})
    assert not _geared(on | {"changes": [(0, {"gear_code": 3})]})  # a master of the host's
    assert not _geared(on | {"config": {"gearing": 0}}) and not _geared(on | {"registers": {"gear_on": 0}})
    assert _geared(on | {"registers": {"position_mode": 1}, "changes": [(9, {"gear_on": 1})]})


@pytest.mark.slow
def test_rtl_in_gear():
    """The RTL in Verilator equals the golden core through clutches, ratios, a stop, changes of mode."""
    from fluxproof.cosim.runs import InVerilator, Named

    job = InVerilator("test_gears", Named("studies.position.gears:every_clutch", (128, 1500)))
    job.carry_out()
    said = job.summary()
    assert job.problem is None and said["periods_compared"] == len(every_clutch(128, 1500)) and not said["differences"]
