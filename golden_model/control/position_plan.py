# SPDX-License-Identifier: BSD-3-Clause
"""The profile of speeds to a target: what each section of M = 8*2**jerk_bits samples adds to the motion.

``speed`` is a multiple of ``move_step``; ``stop`` is the way that remains if each section from now on is slower by
``move_step``, move_step*(1 + 2 + ...).  With ``room`` to the target a section is

    faster   if speed + move_step <= move_speed  and  stop + 2*speed + move_step <= room
    as fast  if speed             <= move_speed  and  stop + speed               <= room
    slower   else
    and at speed zero: the rest of the way, room <= move_step, in one section

so that the way ends at the target exactly, without a division or a square root, whatever the target did before.  Two
moving means over M samples make the profile smooth; the trajectory has them as sums of its second difference,
``change``, which is constant in a section.

A profile that follows goes at the speed of the shaft, up to move_speed, and ``speed`` is the multiple of move_step
below it.

What the gear adds comes on top of the profile: neither ``room`` nor the limits know of it.

Formats: way S(13,44) turns of the shaft, wraps; profile and move_step in units of M**2 * 2**-44 turns per sample, to
which move_speed, and room in sections, are floored: a target is reached to 2**-18 turns, the LSB of a position.
"""

from typing import NamedTuple

from golden_model.control.position_control import POSITION
from golden_model.fixed import Format, wrap_s
from golden_model.kernel import kernel

WAY = Format(1, 13, 44)
WAY_W = WAY.width
SMALL = WAY.frac_bits - POSITION.frac_bits  # bits of the way below a position's
SECTION_BITS = 3  # 8 samples at least
SPEED_UP = 10  # from move_speed to the way
BUSY_W = 4  # sections back in which a profile still moves the trajectory, torque_lead included


class Plan(NamedTuple):
    speed: int = 0  # the profile's magnitude without the rest
    stop: int = 0
    down: int = 0  # 1: backward
    last: int = 0  # the profile, signed, with what the gear adds
    slope: int = 0  # its difference
    change: int = 0  # the difference of that
    busy: int = 0  # a bit for each of the last sections, 1: its profile was not zero
    went: int = 0  # 1: the last profile was not zero without the gear


@kernel
def planned(plan, d, follows, most, bits, gain, geared):
    """The plan of the next section: ``d`` the way to the target, or gone in the last section if it ``follows``;
    ``geared``: what the gear adds to its profile.
    """
    turns = plan.speed == 0 and (d < 0) != (plan.down == 1)
    down = 1 - plan.down if turns else plan.down
    room = wrap_s(-d if down else d, WAY_W) >> (3 * (SECTION_BITS + bits))
    most = (most << SPEED_UP) >> (2 * (SECTION_BITS + bits))
    rest = min(room, most)
    if follows:
        most = rest
    rest = max(rest, 0)
    faster = plan.speed + gain <= most and (follows or plan.stop + 2 * plan.speed + gain <= room)
    as_fast = plan.speed <= most and (follows or plan.stop + plan.speed <= room)
    speed, stop, profile = plan.speed, plan.stop, 0
    if turns and plan.went:  # a section at rest before the way back
        profile = 0
    elif faster:
        stop += speed
        speed += gain
        profile = speed
    elif as_fast:
        profile = speed if speed > 0 and not follows else rest
    else:
        speed = max(speed - gain, 0)
        stop -= speed
        profile = speed if speed > 0 else rest
    last = (-profile if down else profile) + geared
    busy = (plan.busy << 1 | (last != 0)) & ((1 << BUSY_W) - 1)
    slope = last - plan.last
    return Plan(speed, stop, down, last, slope, slope - plan.slope, busy, 1 if profile else 0)
