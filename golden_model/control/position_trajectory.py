# SPDX-License-Identifier: BSD-3-Clause
"""Trajectory to a target with limited speed, acceleration and jerk, and what the loops below are fed forward.

position_plan chooses the jerk of each section of M = 8*2**jerk_bits samples; sums make the motion of it:

    a += jerk;  v += a;  position_ref += v torque_lead samples later

Acceleration is move_step/M at most, jerk 2*move_step/M**2.  Integers throughout: nothing is lost, and at rest
position_ref is the target.  Without ``position_mode`` or ``run`` the profile follows the measured speed and
position_ref the position, so that position mode begins at the speed there is.

    omega_ff += k_filter*(k_speed*v - omega_ff)         the speed as the measurement sees it
    torque_ff = k_inertia*a + k_viscous*v + coulomb*sign(v)       with v of now; zero without position_mode or run

Formats: way S(13,44) turns of the shaft, wraps; v and a S(-3,44) per sample.  v is rounded to 36, a to 42 fraction
bits; these, products and position_ref half up; a's factor, both products, torque_ff and omega_ff saturate.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.control import position_plan
from golden_model.control.position_control import POSITION, POSITION_W
from golden_model.control.position_plan import SMALL, WAY, WAY_W
from golden_model.fixed import Format, round_half_up, round_sat, saturate, wrap_s
from golden_model.formats import BIT, INTEGRAL, INTEGRAL_W, KP, PU, PU_W
from golden_model.io.speed import K_FILTER, K_SPEED
from golden_model.kernel import kernel

V_DROP, A_DROP = 8, 2  # bits of v and a left out of products
FACTOR_W = 34  # then, two halves of 17 bits
K_INERTIA = Format(0, 20, 4)
DROP_OMEGA = WAY.frac_bits - V_DROP + K_SPEED.frac_bits - INTEGRAL.frac_bits
DROP_TORQUE = WAY.frac_bits - A_DROP + K_INERTIA.frac_bits - PU.frac_bits
DROP_VISCOUS = WAY.frac_bits - V_DROP + KP.frac_bits - PU.frac_bits
DROP_ERROR = 6
DROP_FILTER = INTEGRAL.frac_bits - DROP_ERROR + K_FILTER.frac_bits - INTEGRAL.frac_bits


class State(NamedTuple):
    phase: int = 0  # samples since the section's begin
    lead: int = 0  # torque_lead in force
    jerk: int = 0
    at_rest: int = 0
    a: int = 0
    v: int = 0
    v_1: int = 0
    v_2: int = 0
    v_3: int = 0
    v_4: int = 0
    v_5: int = 0
    v_6: int = 0
    ahead: int = 0  # way of the profile that position_ref has not gone yet
    way: int = 0  # position_ref, unrounded
    omega_ff: int = 0
    # Last, the plan's, under its names
    bits: int = 0
    gain: int = 0
    mark: int = 0
    speed: int = 0
    stop: int = 0
    down: int = 0
    last: int = 0
    slope: int = 0
    change: int = 0


@kernel
def delayed(state, v, lead):
    """v of ``lead`` samples ago; the state's are those before v."""
    past = v
    if lead == 1:
        past = state.v
    elif lead == 2:
        past = state.v_1
    elif lead == 3:
        past = state.v_2
    elif lead == 4:
        past = state.v_3
    elif lead == 5:
        past = state.v_4
    elif lead == 6:
        past = state.v_5
    elif lead == 7:
        past = state.v_6
    return past


@kernel
def step(state, inputs, regs):
    s, r, position, run = state, regs, inputs.shaft_position, inputs.run
    active = 1 if r.position_mode and run else 0
    lead, jerk, ahead, at_rest = s.lead, s.jerk, s.ahead, s.at_rest
    plan = position_plan.State(
        bits=s.bits, gain=s.gain, mark=s.mark, speed=s.speed, stop=s.stop, down=s.down, last=s.last, slope=s.slope,
        change=s.change,
    )  # fmt: skip
    if s.phase == 0:
        seen = position_plan.Inputs(shaft_position=position, active=active, way=s.way, ahead=s.ahead)
        plan, (jerk, advance, _, still, at_rest) = position_plan.step(plan, seen, r)
        ahead += advance
        lead = r.torque_lead if still else s.lead
    a = s.a + jerk
    v = s.v + a
    v_used = delayed(s, v, lead)
    way = wrap_s((s.way if active else position << SMALL) + v_used, WAY_W)
    raw = round_sat(r.k_speed * round_half_up(v_used, V_DROP), DROP_OMEGA, INTEGRAL_W)
    error = round_half_up(raw - s.omega_ff, DROP_ERROR)
    omega_ff = saturate(s.omega_ff + round_half_up(r.k_filter * error, DROP_FILTER), INTEGRAL_W)
    by_inertia = round_sat(r.k_inertia * saturate(round_half_up(a, A_DROP), FACTOR_W), DROP_TORQUE, PU_W)
    viscous = round_sat(r.k_viscous * round_half_up(v, V_DROP), DROP_VISCOUS, PU_W)
    coulomb = r.coulomb if v > 0 else -r.coulomb if v < 0 else 0
    torque_ff = saturate(by_inertia + viscous + coulomb, PU_W)
    following = State(
        phase=(s.phase + 1) & position_plan.last_sample(plan.bits), lead=lead, jerk=jerk, at_rest=at_rest, a=a, v=v,
        v_1=s.v, v_2=s.v_1, v_3=s.v_2, v_4=s.v_3, v_5=s.v_4, v_6=s.v_5, ahead=ahead - v_used, way=way,
        omega_ff=omega_ff, bits=plan.bits, gain=plan.gain, mark=plan.mark, speed=plan.speed, stop=plan.stop,
        down=plan.down, last=plan.last, slope=plan.slope, change=plan.change,
    )  # fmt: skip
    position_ref = wrap_s(round_half_up(way, SMALL), POSITION_W)
    return following, (position_ref, omega_ff, torque_ff if active else 0, at_rest)


def reference(v, state):
    """The filters of the sample's own profile, which no rounding touches; the integers of the plan are exact."""
    active = v["position_mode"] and v["run"]
    regs = Registers(**{p.name: p.fmt.to_int(v[p.name]) for p in BLOCK.registers})
    after, _ = step(state, Inputs(POSITION.to_int(v["shaft_position"]), int(v["run"])), regs)
    used = (after.way - (state.way if active else POSITION.to_int(v["shaft_position"]) << SMALL)) * WAY.lsb
    used = (used + 8192.0) % 16384.0 - 8192.0
    raw, half = INTEGRAL.limit(v["k_speed"] * used), POSITION.lsb / 2
    omega = state.omega_ff * INTEGRAL.lsb
    torque = PU.limit(v["k_inertia"] * Format(1, -9, 42).limit(after.a * WAY.lsb))
    torque += PU.limit(v["k_viscous"] * after.v * WAY.lsb) + v["coulomb"] * ((after.v > 0) - (after.v < 0))
    return {
        "position_ref": (after.way * WAY.lsb + 8192.0 + half) % 16384.0 - 8192.0 - half,  # rounded up at the end: wraps
        "omega_ff": INTEGRAL.limit(omega + v["k_filter"] * (raw - omega)),
        "torque_ff": PU.limit(torque) if active else 0.0,
        "at_rest": after.at_rest,
    }


def bound(v, _state):
    """Roundings of v and a at their factors, of the products, of the filter's error and increment, of the position."""
    v_lsb, a_lsb = 2.0 ** (V_DROP - WAY.frac_bits), 2.0 ** (A_DROP - WAY.frac_bits)
    omega = v["k_filter"] * (v["k_speed"] * v_lsb / 2 + INTEGRAL.lsb / 2 + 2.0**DROP_ERROR * INTEGRAL.lsb / 2)
    return {
        "position_ref": POSITION.lsb / 2,
        "omega_ff": omega + INTEGRAL.lsb,
        "torque_ff": v["k_inertia"] * a_lsb / 2 + v["k_viscous"] * v_lsb / 2 + 2 * PU.lsb,
        "at_rest": 0.0,
    }


def stimuli(rng, _config):
    """Moves of every length and both directions, targets that change on the way, stops, followed shafts."""
    rows, position = [], 0
    calm = {"run": 1, "position_mode": 1, "k_speed": 200 << 12, "k_filter": 1 << 16, "k_inertia": 3000 << 4}

    def move(samples, shaft=0, **given):
        nonlocal position
        for _ in range(samples):
            position = wrap_s(position + shaft, POSITION_W)
            rows.append({**calm, **given, "shaft_position": position})

    for bits in (0, 2, 0):
        pace = {"jerk_bits": bits, "torque_lead": (2 * bits + 1) % 8, "move_speed": 1 << 24, "move_step": 3 << 23}
        for target in (0, 1, -1, 5000, 5000, -70000, 3 << 18):
            move(6 << 3 + bits, **pace, position_target=target)
        move(4 << 3 + bits, shaft=300, **pace, position_mode=0)
        move(4 << 3 + bits, shaft=-300, **pace, position_mode=0)
        move(8 << 3 + bits, **pace, position_target=position)
    for _ in range(30):
        pace = {"jerk_bits": int(rng.integers(4)), "torque_lead": int(rng.integers(8))}
        pace |= {"move_speed": int(2 ** rng.uniform(8, 31)), "move_step": int(2 ** rng.uniform(8, 31))}
        pace |= {"k_speed": int(2 ** rng.uniform(8, 24)), "k_filter": int(rng.integers(1 << 16))}
        pace |= {"k_viscous": int(2 ** rng.uniform(0, 24)), "coulomb": int(2 ** rng.uniform(0, 17))}
        pace |= {"k_inertia": int(2 ** rng.uniform(0, 24)), "use_stops": int(rng.integers(2))}
        low, high = sorted(int(x) for x in rng.integers(-(1 << 20), 1 << 20, 2))
        target = int(rng.integers(POSITION.lo, POSITION.hi)) >> int(rng.integers(20))
        pace |= {"stop_low": low, "stop_high": high, "position_target": target}
        move(int(rng.integers(9, 90)), int(rng.integers(-4000, 4000)), **pace, position_mode=int(rng.integers(5) > 0))
    return rows


REGISTERS = (
    Port("position_mode", BIT, doc="1: position control, over speed control"),
    *position_plan.REGISTERS,
    Port("torque_lead", Format(0, 3, 0), doc="samples by which torque_ff precedes the position"),
    Port("k_speed", K_SPEED, doc="speed per turn and sample"),
    Port("k_filter", K_FILTER, hi=1 << 16, doc="filter weight of the new sample, 1 = no filter"),
    Port("k_inertia", K_INERTIA, doc="torque, or current, per turn and square of a sample"),
    Port("k_viscous", KP, doc="torque, or current, of viscous friction per turn and sample"),
    Port("coulomb", PU, lo=0, doc="torque, or current, of Coulomb friction"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
Inputs = namedtuple("Inputs", ["shaft_position", "run"])

BLOCK = Block(
    name="position_trajectory",
    folder="control",
    paper="none: docs/position.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=(
        Port("shaft_position", POSITION, doc="position, turns of the shaft"),
        Port("run", BIT, doc="1: the gates are switching"),
    ),
    registers=REGISTERS,
    outputs=(
        Port("position_ref", POSITION, doc="reference for the next sample, turns of the shaft"),
        Port("omega_ff", INTEGRAL, doc="speed of the trajectory"),
        Port("torque_ff", PU, doc="torque, or current, of the acceleration"),
        Port("at_rest", BIT, doc="1: the trajectory stands"),
    ),
    state=State(),
    latency=36,
    interval=37,
    constants={
        "V_DROP": V_DROP,
        "A_DROP": A_DROP,
        "FACTOR_W": FACTOR_W,
        "DROP_OMEGA": DROP_OMEGA,
        "DROP_TORQUE": DROP_TORQUE,
        "DROP_VISCOUS": DROP_VISCOUS,
        "DROP_ERROR": DROP_ERROR,
        "DROP_FILTER": DROP_FILTER,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
