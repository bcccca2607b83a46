# SPDX-License-Identifier: BSD-3-Clause
"""The profile of speeds to a target: what each section of M = 8*2**jerk_bits samples adds to the motion.

``speed`` is a multiple of ``move_step``; ``stop`` is the way that remains if each section from now on is slower by
``move_step``, move_step*(1 + 2 + ...).  With ``room`` to the target a section is

    faster   if speed + move_step <= move_speed  and  stop + 2*speed + move_step <= room
    as fast  if speed             <= move_speed  and  stop + speed               <= room
    slower   else
    and at speed zero: the rest of the way, room <= move_step, in one section

so that the way ends at the target exactly, without a division or a square root, whatever the target did before.  Two
moving means over M samples make the profile smooth; the trajectory has them as sums of its second difference, ``jerk``,
which is constant in a section.  The way of a section is ``advance`` = M*profile.

Without ``active`` the profile follows the speed of the shaft in the section before, up to move_speed, and ``speed`` is
the multiple of move_step below it.  ``use_stops``
keeps the target within stop_low..stop_high.  New move_step and jerk_bits wait for rest (``still``).

Formats: way S(13,44) turns of the shaft, wraps; profile and move_step in units of M**2 * 2**-44 turns per sample, to
which move_speed, and room in sections, are floored: a target is reached to 2**-18 turns, the LSB of a position.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.control.position_control import POSITION, POSITION_W
from golden_model.fixed import Format, clamp, wrap_s
from golden_model.formats import BIT
from golden_model.kernel import kernel

WAY = Format(1, 13, 44)
WAY_W = WAY.width
SMALL = WAY.frac_bits - POSITION.frac_bits  # bits of the way below a position's
AHEAD = Format(1, 7, 44)
SECTION_BITS = 3  # 8 samples at least
PROFILE_W = 35
JERK = Format(1, PROFILE_W + 2, 0)
FAR = 1 << 46  # the way that the speed may need to stop while it follows


class State(NamedTuple):
    bits: int = 0  # jerk_bits and move_step in force
    gain: int = 0
    mark: int = 0  # position at the section's begin
    speed: int = 0  # the profile's magnitude without the rest
    stop: int = 0
    down: int = 0  # 1: backward
    last: int = 0  # the profile, signed
    slope: int = 0  # its difference
    change: int = 0  # the difference of that


@kernel
def last_sample(bits):
    """Number of a section's last sample."""
    return (1 << (SECTION_BITS + bits)) - 1


@kernel
def profiled(state, d, active, move_speed, bits, gain):
    """(speed, stop, down, profile): the next section, ``d`` the way to the target, or gone in the last section."""
    back = 1 if d < 0 else 0
    turns = state.speed == 0 and d != 0 and back != state.down
    down = back if turns else state.down
    room = (-d if down else d) >> (3 * (SECTION_BITS + bits))
    most = (move_speed << 4) >> (2 * bits)
    if not active:
        most, room = clamp(room, 0, most), FAR
    rest = min(max(room, 0), most)
    speed, stop, profile = state.speed, state.stop, 0
    if turns and state.last != 0:  # a section at rest before the way back
        return speed, stop, down, profile
    if speed + gain <= most and stop + 2 * speed + gain <= room:
        stop += speed
        speed += gain
        profile = speed
    elif speed <= most and stop + speed <= room:
        profile = speed if speed > 0 and active else rest
    else:
        speed = max(speed - gain, 0)
        stop -= speed
        profile = speed if speed > 0 else rest
    return speed, stop, down, -profile if down else profile


@kernel
def step(state, inputs, regs):
    s, x, r = state, inputs, regs
    still = s.speed == 0 and s.last == 0 and s.slope == 0 and s.change == 0
    bits, gain = (r.jerk_bits, r.move_step) if still else (s.bits, s.gain)
    d = wrap_s(x.shaft_position - s.mark, POSITION_W) << SMALL
    if x.active:
        target = clamp(r.position_target, r.stop_low, r.stop_high) if r.use_stops else r.position_target
        d = wrap_s((target << SMALL) - x.way - x.ahead, WAY_W)
    speed, stop, down, last = profiled(s, d, x.active, r.move_speed, bits, gain)
    slope = last - s.last
    change = slope - s.slope
    following = State(bits, gain, x.shaft_position, speed, stop, down, last, slope, change)
    rest = 1 if still and last == 0 else 0
    advance = last << (3 * (SECTION_BITS + bits))
    return following, (change, advance, last_sample(bits), 1 if still else 0, rest)


def stimuli(rng, _config):
    """Moves of every length in both directions, targets that change on the way, followed speeds, every section."""
    rows, way = [], 0
    state = State()

    def move(sections, **given):
        nonlocal way, state
        for _ in range(sections):
            row = {"active": 1, "move_speed": 1 << 24, "move_step": 3 << 23, "way": way, **given}
            rows.append(row)
            values = {p.name: row.get(p.name, 0) for p in (*BLOCK.inputs, *BLOCK.registers)}
            state, out = BLOCK.run(state, values, {})
            way = wrap_s(way + out["advance"], WAY_W)

    for bits in range(6):
        for target in (0, 1, -1, 5000, -70000, 3 << 18, POSITION.hi, POSITION.lo):
            move(30, position_target=target, jerk_bits=bits)
        for _ in range(12):
            move(1, active=0, shaft_position=int(rng.integers(-9999, 9999)), jerk_bits=bits)
        move(30, position_target=way >> SMALL, jerk_bits=bits)
    for _ in range(80):
        low, high = sorted(int(x) for x in rng.integers(-(1 << 20), 1 << 20, 2))
        given = {"jerk_bits": int(rng.integers(6)), "use_stops": int(rng.integers(2)), "stop_low": low}
        given |= {"move_speed": int(2 ** rng.uniform(8, 31)), "move_step": int(2 ** rng.uniform(0, 31))}
        given |= {"position_target": int(rng.integers(POSITION.lo, POSITION.hi)) >> int(rng.integers(20))}
        move(int(rng.integers(1, 30)), **given, stop_high=high, ahead=int(rng.integers(AHEAD.lo, AHEAD.hi)) >> 30)
    return rows


INPUTS = (
    Port("shaft_position", POSITION, doc="position, turns of the shaft"),
    Port("active", BIT, doc="1: to the target, 0: follow the shaft"),
    Port("way", WAY, doc="position reference, unrounded"),
    Port("ahead", AHEAD, doc="way of the profile that the position reference has not gone yet"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("position_target", POSITION, doc="position to go to, turns of the shaft"),
    Port("move_speed", Format(0, -3, 34), doc="largest speed of the trajectory, turns per sample"),
    Port("move_step", Format(0, 31, 0), doc="largest change of its speed in 8*2**jerk_bits samples"),
    Port("jerk_bits", Format(0, 3, 0), hi=5, doc="the acceleration builds up in 8*2**jerk_bits samples"),
    Port("use_stops", BIT, doc="1: the target is kept within stop_low and stop_high"),
    Port("stop_low", POSITION, doc="soft end stop, turns of the shaft"),
    Port("stop_high", POSITION, doc="soft end stop, turns of the shaft"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="position_plan",
    folder="control",
    paper="none: docs/position.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("jerk", JERK, doc="second difference of the profile"),
        Port("advance", AHEAD, doc="way of the section"),
        Port("last_sample", Format(0, 8, 0), doc="number of the section's last sample"),
        Port("still", BIT, doc="1: nothing moves when the section begins"),
        Port("at_rest", BIT, doc="1: nor in the section"),
    ),
    state=State(),
    latency=20,
    interval=20,
    constants={"WAY_W": WAY_W, "SMALL": SMALL, "AHEAD_W": AHEAD.width, "PROFILE_W": PROFILE_W},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
