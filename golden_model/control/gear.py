# SPDX-License-Identifier: BSD-3-Clause
"""Electronic gearing: the way of this shaft that the turning of a second encoder, the master, asks for.

    delta  = wrap(gear_code - last code)
    acting moves towards gear_numerator while the gear acts, else towards zero, by gear_step a sample
    way   += floor((rest + delta*acting) / gear_denominator),  rest: what that division left

The gear acts with gear_on until the trajectory tells that it came to a stop (``at_stop``); then gear_on = 0 and 1 begin
anew.  While the trajectory follows the shaft (``gear_free``) all is zero.  The numerator grows and shrinks linearly:
a master that turns gives no step.  The rest is kept, so that

    way*gear_denominator + rest = sum of delta*acting                              (modulo 2**14 turns)

for ever: no drift, whatever the directions and the ends of both counters.  The shaft is late by the trajectory's time;
``led`` is ahead by gear_lead samples at the mean speed of 2**gear_smooth samples:

    speed += (change of way - speed) / 2**gear_smooth;    led = way + gear_lead*speed

Formats: way and led S(13,18) turns, wrap; acting S(15,9), rest U(16,9) in units of an LSB of way over the
denominator; speed S(-3,39) turns per sample, of a change limited to an eighth of a turn, floored, to S(-3,27) before
the multiplier; the lead rounded half up.  led changes by an eighth of a turn a sample at most and catches up.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.control.position_control import POSITION, POSITION_W
from golden_model.fixed import Format, clamp, round_half_up, saturate, wrap_s
from golden_model.formats import BIT, TURN, TURN_W
from golden_model.kernel import kernel

PART = 9  # fraction bits of the numerator in force
NUMERATOR = Format(1, 15, 0)
ACTING_W = NUMERATOR.width + PART
REST_W = 16 + PART
CHANGE_W = 16  # bits of the change of way that the mean speed takes
SMOOTH_MOST = 12
SPEED_UP = PART + SMOOTH_MOST  # fraction bits of the mean speed below way's
SPEED_W = CHANGE_W + SPEED_UP
MOST = 1 << (CHANGE_W - 1)  # largest change of led, an eighth of a turn
X_W = TURN_W + ACTING_W  # of rest + delta*acting
DIGITS = X_W - PART - 1  # of the quotient without its sign, one a clock
LATENCY = DIGITS + 9


class State(NamedTuple):
    code: int = 0
    seen: int = 0
    acting: int = 0
    rest: int = 0
    way: int = 0
    speed: int = 0
    led: int = 0
    stopped: int = 0


@kernel
def step(state, inputs, regs):
    s, x, r = state, inputs, regs
    delta = wrap_s(r.gear_code - s.code, TURN_W) if s.seen else 0
    stopped = 1 if r.gear_on and (s.stopped or x.at_stop) else 0
    acts = 1 if r.gear_on and not stopped and not x.gear_free else 0
    asked = r.gear_numerator << PART if acts else 0
    acting = 0 if x.gear_free else s.acting + clamp(asked - s.acting, -r.gear_step, r.gear_step)
    total = s.rest + delta * acting
    change = total // (r.gear_denominator << PART)
    rest = total - change * (r.gear_denominator << PART)
    lead = round_half_up(r.gear_lead * (s.speed >> SMOOTH_MOST), PART)
    way = wrap_s(s.way + change, POSITION_W)
    speed = s.speed + (((saturate(change, CHANGE_W) << SPEED_UP) - s.speed) >> r.gear_smooth)
    behind = wrap_s(way + lead - s.led, POSITION_W)
    led = wrap_s(s.led + clamp(behind, -MOST, MOST), POSITION_W)
    engaged = 1 if acts and acting == asked and -MOST <= behind <= MOST else 0
    if x.gear_free:
        way, speed, led = 0, 0, 0
    following = State(
        code=r.gear_code, seen=1, acting=acting, rest=rest, way=way, speed=speed, led=led, stopped=stopped
    )  # fmt: skip
    return following, (way, led, engaged, stopped)


def _turns(x):
    """Within the range of a position."""
    return (x + 2.0**13) % 2.0**14 - 2.0**13


def reference(v, state):
    """The division without its rest; the lead at the mean speed of the samples before."""
    s, lsb, part = state, POSITION.lsb, 2.0**PART
    delta = (v["gear_code"] - s.code * TURN.lsb + 0.5) % 1.0 - 0.5 if s.seen else 0.0
    stopped = v["gear_on"] and (s.stopped or v["at_stop"])
    acts = v["gear_on"] and not stopped and not v["gear_free"]
    asked = v["gear_numerator"] if acts else 0.0
    acting = s.acting / part + min(max(asked - s.acting / part, -v["gear_step"]), v["gear_step"])
    acting = 0.0 if v["gear_free"] else acting
    way = s.way * lsb + (s.rest * lsb / part + delta * acting) / v["gear_denominator"]
    behind = _turns(way + v["gear_lead"] * s.speed * lsb / 2.0**SPEED_UP - s.led * lsb)
    led = s.led * lsb + min(max(behind, -MOST * lsb), MOST * lsb)
    engaged = acts and acting == asked and -MOST * lsb <= behind <= MOST * lsb
    moves = 0.0 if v["gear_free"] else 1.0
    return {
        "gear_way": moves * _turns(way),
        "led": moves * _turns(led),
        "gear_engaged": float(bool(engaged)),
        "gear_stopped": float(bool(stopped)),
    }


def bound(v, _state):
    """The rest of the division; with it the floor of the speed, taken gear_lead times, and its rounding."""
    lead = v["gear_lead"] * POSITION.lsb / 2.0**PART + POSITION.lsb / 2
    return {"gear_way": POSITION.lsb, "led": POSITION.lsb + lead, "gear_engaged": 0.0, "gear_stopped": 0.0}


def stimuli(rng, _config):
    """Masters of every speed in both directions, ratios, clutches at speed, ends of all counters, changed ratios."""
    rows, code = [], 0
    calm = {"gear_numerator": 3, "gear_denominator": 7, "gear_step": (1 << 25) - 1, "gear_on": 1}

    def turn(samples, speed, **given):
        nonlocal code
        for _ in range(samples):
            code = (code + speed) % (1 << TURN_W)
            rows.append({**calm, **given, "gear_code": code})

    for speed in (1, -1, 5, -5, 6, 7, 100003, -100003, (1 << 17) - 1, 1 << 17):
        turn(12, speed)
    for numerator, denominator in ((32767, 1), (-32768, 1), (-32768, 65535), (1, 65535), (-1, 2), (65, 64)):
        for speed in (1, -1, 131071, -131072, 0, 13):
            turn(6, speed, gear_numerator=numerator, gear_denominator=denominator)
    for step in (1, 40, 4000):  # clutch in, out, another ratio, in at the other sign
        slow = {"gear_step": step, "gear_numerator": 4, "gear_lead": 19, "gear_smooth": 3}
        turn(40, 900, **slow)
        turn(40, 900, **slow, gear_on=0)
        turn(20, -900, **(slow | {"gear_numerator": -2}))
        turn(5, 900, **slow, at_stop=1)
        turn(5, 900, **slow)
        turn(5, 900, **slow, gear_on=0)
        turn(30, 900, **slow)
        turn(3, 900, **slow, gear_free=1)
    odd = {"gear_numerator": 1, "gear_denominator": 1, "gear_step": 3}
    for k in range(80):  # odd numerators in force: the rest passes every value of its lowest bits
        turn(1, 37, **odd, gear_on=k & 1)
    for _ in range(20):  # errors of the mean speed's lowest bit add up until the longest lead shows them
        turn(10, int(rng.integers(30, 9000)), gear_lead=1023, gear_smooth=8)
    for smooth in (0, 1, 5, 12):  # the lead, at its limit and away from it
        for lead in (0, 1, 530, 1023):
            turn(25, 70, gear_lead=lead, gear_smooth=smooth)
            turn(4, 0, gear_lead=lead, gear_smooth=smooth)
    for _ in range(60):
        given = {"gear_numerator": int(rng.integers(-32768, 32768)) >> int(rng.integers(16))}
        given |= {"gear_denominator": int(2 ** rng.uniform(0, 16)), "gear_step": int(2 ** rng.uniform(0, 25))}
        given |= {"gear_lead": int(2 ** rng.uniform(0, 10)), "gear_smooth": int(rng.integers(SMOOTH_MOST + 1))}
        given |= {"gear_on": int(rng.integers(6) > 0), "at_stop": int(rng.integers(12) == 0)}
        turn(int(rng.integers(3, 12)), int(rng.integers(-(1 << 17), 1 << 17)) >> int(rng.integers(17)), **given)
    return rows


INPUTS = (
    Port("gear_free", BIT, doc="1: the trajectory follows the shaft"),
    Port("at_stop", BIT, doc="1: the gear would lead beyond a soft end stop"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("gear_code", TURN, doc="position code of the master, left-aligned; its front end sets it for each sample"),
    Port("gear_on", BIT, doc="1: position mode follows the master"),
    Port("gear_numerator", NUMERATOR, doc="turns of this shaft in gear_denominator turns of the master"),
    Port("gear_denominator", Format(0, 16, 0), lo=1, doc="turns of the master"),
    Port("gear_step", Format(0, 16, PART), lo=1, doc="largest change of the numerator in force in a sample"),
    Port("gear_lead", Format(0, 10, 0), doc="samples by which the way is ahead at the master's mean speed"),
    Port("gear_smooth", Format(0, 4, 0), hi=SMOOTH_MOST, doc="that speed is a mean of 2**gear_smooth samples"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="gear",
    folder="control",
    paper="none: docs/gearing.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("gear_way", POSITION, doc="way that the gear asks for since position mode began, turns of the shaft"),
        Port("led", POSITION, doc="the same with its lead"),
        Port("gear_engaged", BIT, doc="1: the gear has its ratio"),
        Port("gear_stopped", BIT, doc="1: a soft end stop ended the gear; gear_on = 0 clears it"),
    ),
    state=State(),
    latency=LATENCY,
    interval=LATENCY + SMOOTH_MOST,
    constants={
        "PART": PART,
        "ACTING_W": ACTING_W,
        "REST_W": REST_W,
        "CHANGE_W": CHANGE_W,
        "SMOOTH_MOST": SMOOTH_MOST,
        "SPEED_UP": SPEED_UP,
        "X_W": X_W,
        "DIGITS": DIGITS,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
