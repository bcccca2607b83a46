# SPDX-License-Identifier: BSD-3-Clause
"""Trajectory to a target with limited speed, acceleration and jerk, and what the loops below are fed forward.

position_plan chooses the change of each section of M = 8*2**jerk_bits samples; sums make the motion of it, once for
the torque and once for position and speed, which are torque_lead samples later:

    a += change;  v += a            late_a += late_change;  late_v += late_a;  way += late_v

Acceleration is move_step/M at most, jerk 2*move_step/M**2.  Integers throughout: nothing is lost, and at rest
position_ref is the target.  Without ``position_mode`` or ``run`` the profile follows the measured speed and
position_ref the position, so that position mode begins at the speed there is.

    omega_ff += k_filter*(k_speed*late_v - omega_ff)              the speed as the measurement sees it
    torque_ff = k_inertia*a + k_viscous*v + coulomb*sign(v)       zero without position_mode or run

A gear's way is added: that of a section to the profile of the next one, all of it to the target, which the stops then
limit; ``at_stop`` tells that they do.  While the profile follows (``gear_free``) there is no such way.

In the last eight samples of a section the next one is planned: in the second of them the target is read, at rest
move_step, jerk_bits and torque_lead too, in the third the positions and the gear's way, in the fifth move_speed.

Formats: way S(13,44) turns of the shaft, wraps, half an LSB of a position above position_ref; v and a S(-3,44) per
sample, floored to 35 fraction bits in products, as are the products to 17 bits less and all that follows.  The error of
the filter is limited to +-2, torque_ff and omega_ff saturate; the state of the filter does not.  Products take v and a
modulo a turn per sample, which a gear reaches whose way is not gear's.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.control.gear import LATENCY as GEAR_LATE
from golden_model.control.position_control import POSITION, POSITION_W
from golden_model.control.position_plan import BUSY_W, SECTION_BITS, SMALL, SPEED_UP, WAY, WAY_W, Plan, planned
from golden_model.fixed import Format, clamp, saturate, wrap_s
from golden_model.formats import BIT, INTEGRAL, INTEGRAL_W, PU, PU_W
from golden_model.io.speed import K_FILTER, K_SPEED
from golden_model.kernel import kernel

DROP = 9  # bits of v and a left out of products
LOW = 17  # bits of the lower half of a factor, and of a product left out
SUM = Format(1, 24, 33)  # torque_ff and the filter before they are narrowed
ERROR_W = 18  # of its upper half
FACTOR_W = LOW + ERROR_W
K_INERTIA = Format(0, 21, 3)
K_VISCOUS = Format(0, 9, 15)
PARTS = 1 << SECTION_BITS  # samples in which a section is planned
HALF = 1 << (SMALL - 1)
LATE = 7  # position_control's latency: the program starts beside it
LATENCY = 54
INTERVAL = 56  # the longest part of the plan changes no output behind it
UP_INERTIA = SUM.frac_bits - (WAY.frac_bits - DROP - LOW + K_INERTIA.frac_bits)
UP_SPEED = SUM.frac_bits - (WAY.frac_bits - DROP - LOW + K_SPEED.frac_bits)
TO_PU = SUM.frac_bits - PU.frac_bits
TO_INTEGRAL = SUM.frac_bits - INTEGRAL.frac_bits


class State(NamedTuple):
    part: int = 0  # sample of eight
    left: int = 0  # eights of the section that are left after this one
    first: int = 1  # 1: the first eight
    bits: int = 0  # jerk_bits, torque_lead, move_step in force
    lead: int = 0
    gain: int = 0
    a: int = 0
    v: int = 0
    late_change: int = 0
    late_a: int = 0
    late_v: int = 0
    ahead: int = 0  # way of the profile that position_ref has not gone yet
    way: int = 0  # position_ref, unrounded
    omega: int = 0  # SUM
    goal: int = 0  # the target within the stops
    mark: int = 0  # position at the last plan
    d: int = 0  # way to the goal, or gone
    follows: int = 1
    most: int = 0
    given: int = 0  # way of the gear up to the last plan, POSITION
    geared: int = 0  # the same of the next section alone
    at_stop: int = 0
    # Last, the plan's, under its names
    speed: int = 0
    stop: int = 0
    down: int = 0
    last: int = 0
    slope: int = 0
    change: int = 0
    busy: int = 0
    went: int = 0


@kernel
def factor(x):
    """v or a as the multiplier takes it."""
    return wrap_s(x >> DROP, FACTOR_W)


@kernel
def product(k, x):
    """k*x in two halves, the lower one floored first."""
    return (k * x) >> LOW


@kernel
def step(state, inputs, regs):
    s, r, position = state, regs, (inputs.shaft_position << SMALL) + HALF
    active = 1 if r.position_mode and inputs.run else 0
    late_change = s.change if s.first and s.part == s.lead else s.late_change
    a = s.a + s.change
    v = s.v + a
    late_a = s.late_a + late_change
    late_v = s.late_v + late_a
    way = wrap_s((s.way if active else position) + late_v, WAY_W)
    ahead = s.ahead - late_v
    torque = (product(r.k_inertia, factor(a)) << UP_INERTIA) + product(r.k_viscous, factor(v))
    torque += (r.coulomb if v > 0 else -r.coulomb if v < 0 else 0) << TO_PU
    raw = product(r.k_speed, factor(late_v)) << UP_SPEED
    error = raw - s.omega
    error = saturate(error >> LOW, ERROR_W) << LOW | error & ((1 << LOW) - 1)
    omega = s.omega + product(r.k_filter << 1, error)

    part, left, first, bits, lead, gain = s.part, s.left, s.first, s.bits, s.lead, s.gain
    goal, mark, d, follows, most = s.goal, s.mark, s.d, s.follows, s.most
    given, geared, at_stop = s.given, s.geared, s.at_stop
    plan = Plan(s.speed, s.stop, s.down, s.last, s.slope, s.change, s.busy, s.went)
    if left == 0:
        if part == 1:
            asked = wrap_s(r.position_target + given, POSITION_W)
            goal = clamp(asked, r.stop_low, r.stop_high) if r.use_stops else asked
            beyond = asked > r.stop_high or min(asked, r.stop_high) < r.stop_low
            at_stop = 1 if r.use_stops and beyond and not follows else 0
            if s.busy == 0:
                bits, lead, gain = r.jerk_bits, r.torque_lead, r.move_step
        elif part == 2:
            follows = 1 - active
            d = wrap_s(position - mark if follows else (goal << SMALL) + HALF - way - ahead, WAY_W)
            mark = position
            led = 0 if follows else inputs.led
            geared = 0 if follows else wrap_s(led - given, POSITION_W)
            given = led
        elif part == 4:
            most = r.move_speed
        elif part == PARTS - 1:
            added = (geared << SMALL) >> (3 * (SECTION_BITS + bits))
            plan = planned(plan, d, follows, most, bits, gain, added)
            ahead += plan.last << (3 * (SECTION_BITS + bits))
    if part == PARTS - 1:
        first = 1 if left == 0 else 0
        left = (1 << bits) - 1 if left == 0 else left - 1
    following = State(
        part=(part + 1) % PARTS, left=left, first=first, bits=bits, lead=lead, gain=gain, a=a, v=v,
        late_change=late_change, late_a=late_a, late_v=late_v, ahead=ahead, way=way, omega=omega, goal=goal, mark=mark,
        d=d, follows=follows, most=most, given=given, geared=geared, at_stop=at_stop, speed=plan.speed, stop=plan.stop,
        down=plan.down, last=plan.last, slope=plan.slope, change=plan.change, busy=plan.busy, went=plan.went,
    )  # fmt: skip
    torque_ff = saturate(torque >> TO_PU, PU_W) if active else 0
    omega_ff = saturate(omega >> TO_INTEGRAL, INTEGRAL_W)
    return following, (way >> SMALL, omega_ff, torque_ff, int(plan.busy == 0), follows, at_stop)


def reference(v, state):
    """The filters of the sample's own profile, which no rounding touches; the integers of the plan are exact."""
    active = v["position_mode"] and v["run"]
    regs = Registers(**{p.name: p.fmt.to_int(v[p.name]) for p in BLOCK.registers})
    after, _ = step(state, Inputs(POSITION.to_int(v["shaft_position"]), POSITION.to_int(v["led"]), int(v["run"])), regs)
    late_v, speed, a = (wrap_s(x, DROP + FACTOR_W) * WAY.lsb for x in (after.late_v, after.v, after.a))
    error = PU.limit(v["k_speed"] * late_v - state.omega * SUM.lsb)
    torque = v["k_inertia"] * a + v["k_viscous"] * speed
    torque += v["coulomb"] * ((after.v > 0) - (after.v < 0))
    half = POSITION.lsb / 2
    return {
        "position_ref": after.way * WAY.lsb - half,
        "omega_ff": INTEGRAL.limit(state.omega * SUM.lsb + v["k_filter"] * error),
        "torque_ff": PU.limit(torque) if active else 0.0,
        "at_rest": float(after.busy == 0),
        "gear_free": float(after.follows),
        "at_stop": float(after.at_stop),
    }


def bound(v, _state):
    """Floors of v and a at their factors, of products and outputs, the lower half of a limited error."""
    factor = 2.0 ** (DROP - WAY.frac_bits)
    speed = v["k_speed"] * factor + SUM.lsb * 2**UP_SPEED
    return {
        "position_ref": POSITION.lsb / 2,
        "omega_ff": v["k_filter"] * (speed + PU.lsb) + SUM.lsb + INTEGRAL.lsb,
        "torque_ff": (v["k_inertia"] + v["k_viscous"]) * factor + SUM.lsb * (2**UP_INERTIA + 1) + PU.lsb,
        "at_rest": 0.0,
        "gear_free": 0.0,
        "at_stop": 0.0,
    }


def stimuli(rng, _config):
    """Moves of every length and both directions, targets that change on the way, stops, followed shafts."""
    rows, position, led = [], 0, 0
    calm = {"run": 1, "position_mode": 1, "k_speed": 200 << 12, "k_filter": 1 << 16, "k_inertia": 3000 << 3}

    def move(samples, shaft=0, master=0, **given):
        nonlocal position, led
        for _ in range(samples):
            position, led = wrap_s(position + shaft, POSITION_W), wrap_s(led + master, POSITION_W)
            rows.append({**calm, **given, "shaft_position": position, "led": led})

    for bits in (0, 2, 0):
        pace = {"jerk_bits": bits, "torque_lead": (2 * bits + 1) % 8, "move_speed": 1 << 24, "move_step": 3 << 23}
        for target in (0, 1, -1, 5000, 5000, -70000, 3 << 18):
            move(6 << 3 + bits, **pace, position_target=target)
        move(4 << 3 + bits, shaft=300, **pace, position_mode=0)
        move(4 << 3 + bits, shaft=-300, **pace, position_mode=0)
        move(8 << 3 + bits, **pace, position_target=position)
        stops = {"use_stops": 1, "stop_low": -9000, "stop_high": 9000}
        for master, target in ((700, 0), (700, -40000), (-1500, 0), (-1500, 300000), (0, 0), (32768, 5)):
            move(3 << 3 + bits, master=master, **pace, position_target=target, **(stops if master == 700 else {}))
        led = 0
        move(2 << 3 + bits, shaft=20, **pace, position_mode=0)
        move(3 << 3 + bits, master=9, **pace, position_target=position)
        move(3 << 3 + bits, **pace, position_target=position)
    for _ in range(30):
        pace = {"jerk_bits": int(rng.integers(4)), "torque_lead": int(rng.integers(8))}
        pace |= {"move_speed": int(2 ** rng.uniform(8, 31)), "move_step": int(2 ** rng.uniform(8, 31))}
        pace |= {"k_speed": int(2 ** rng.uniform(8, 24)), "k_filter": int(rng.integers(1 << 16))}
        pace |= {"k_viscous": int(2 ** rng.uniform(0, 24)), "coulomb": int(2 ** rng.uniform(0, 17))}
        pace |= {"k_inertia": int(2 ** rng.uniform(0, 24)), "use_stops": int(rng.integers(2))}
        low, high = sorted(int(x) for x in rng.integers(-(1 << 20), 1 << 20, 2))
        target = int(rng.integers(POSITION.lo, POSITION.hi)) >> int(rng.integers(20))
        pace |= {"stop_low": low, "stop_high": high, "position_target": target}
        shaft, master = (int(x) for x in rng.integers(-4000, 4000, 2))
        move(int(rng.integers(9, 90)), shaft, master, **pace, position_mode=int(rng.integers(5) > 0))
    return rows


REGISTERS = (
    Port("position_mode", BIT, doc="1: position control, over speed control"),
    Port("position_target", POSITION, doc="position to go to, turns of the shaft"),
    Port("move_speed", Format(0, -3, 34), doc="largest speed of the trajectory, turns per sample"),
    Port("move_step", Format(0, 31, 0), doc="largest change of its speed in 8*2**jerk_bits samples"),
    Port("jerk_bits", Format(0, 3, 0), hi=5, doc="the acceleration builds up in 8*2**jerk_bits samples"),
    Port("use_stops", BIT, doc="1: the target is kept within stop_low and stop_high"),
    Port("stop_low", POSITION, doc="soft end stop, turns of the shaft"),
    Port("stop_high", POSITION, doc="soft end stop, turns of the shaft"),
    Port("torque_lead", Format(0, 3, 0), doc="samples by which torque_ff precedes the position"),
    Port("k_speed", K_SPEED, doc="speed per turn and sample"),
    Port("k_filter", K_FILTER, hi=1 << 16, doc="filter weight of the new sample, 1 = no filter"),
    Port("k_inertia", K_INERTIA, doc="torque, or current, per turn and square of a sample"),
    Port("k_viscous", K_VISCOUS, doc="torque, or current, of viscous friction per turn and sample"),
    Port("coulomb", PU, lo=0, doc="torque, or current, of Coulomb friction"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
Inputs = namedtuple("Inputs", ["shaft_position", "led", "run"])

BLOCK = Block(
    name="position_trajectory",
    folder="control",
    paper="none: docs/position.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=(
        Port("shaft_position", POSITION, late=LATE, doc="position, turns of the shaft"),
        Port("led", POSITION, late=GEAR_LATE, doc="way of the gear with its lead, turns of the shaft"),
        Port("run", BIT, doc="1: the gates are switching"),
    ),
    registers=REGISTERS,
    outputs=(
        Port("position_ref", POSITION, doc="reference for the next sample, turns of the shaft"),
        Port("omega_ff", INTEGRAL, doc="speed of the trajectory"),
        Port("torque_ff", PU, doc="torque, or current, of the acceleration"),
        Port("at_rest", BIT, doc="1: the trajectory stands"),
        Port("gear_free", BIT, doc="1: the trajectory follows the shaft"),
        Port("at_stop", BIT, doc="1: the target and the gear's way are beyond a soft end stop"),
    ),
    state=State(),
    latency=LATENCY,
    interval=INTERVAL,
    constants={
        "WAY_W": WAY_W,
        "SMALL": SMALL,
        "BUSY_W": BUSY_W,
        "DROP": DROP,
        "SPEED_UP": SPEED_UP,
        "LOW": LOW,
        "TO_PU": TO_PU,
        "TO_INTEGRAL": TO_INTEGRAL,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
