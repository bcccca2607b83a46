# SPDX-License-Identifier: BSD-3-Clause
"""Plausibility checks of a raw sample, one bit each, evaluated with every sample.

    0  overcurrent    |i_x| >= i_trip in any phase
    1  current sum    |i_a + i_b + i_c| >= sum_trip: a sensor is lost, stuck or wrong
    2  at the rail    a code at its end in ``rail_samples`` consecutive samples
    3  bus low        u_dc < u_dc_min
    4  bus high       u_dc >= u_dc_max
    5  position       |code - (2*code' - code'')| >= jump_max: more than the shaft can accelerate within a sample

Check 5 detects a jump of the code, and a code that freezes while the shaft turns by ``jump_max`` per sample or more.  A
frozen code at lower speed looks like a shaft at rest.  Check 5 starts with the third sample after a reset; a sample
with ``position_restart`` is the first one again.
``sample_trip``: at least one fault that ``fault_ignore`` does not mask.

Formats: currents and voltage are cut (floor) to U(1,8), |x| is the one's complement where x is negative: a negative
current trips one LSB (16 bits) later than a positive one, the sum at most 3/256 per unit later or earlier.
Codes in 1/2**18 turn; their difference is the shorter angle, floored to U(-1,13).  The rail counter saturates.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, wrap, wrap_s
from golden_model.formats import BIT, LIMIT, PU, TURN_W, U_DC
from golden_model.io.position import code_format
from golden_model.kernel import kernel

JUMP = Format(0, -1, 13)
SAMPLES = Format(0, 4, 0)
CHECKS = Format(0, 6, 0)
IGNORE = Format(0, 16, 0)  # the faults of fault_latch
DROP_LIMIT = PU.frac_bits - LIMIT.frac_bits
DROP_JUMP = TURN_W - JUMP.frac_bits
WARM = 2  # samples before the next code can be extrapolated
SAMPLES_HI = SAMPLES.hi


class State(NamedTuple):
    code: int = 0  # of the last sample, in 1/2**18 turn
    expected: int = 0  # of the coming sample, if the speed stays
    seen: int = 0  # samples since the reset, WARM at most
    railed: int = 0  # consecutive samples at the rail, 15 at most


@kernel
def reaches(x, limit):
    """Whether |x| >= limit, |x| being the one's complement where x is negative."""
    return (x if x >= 0 else -1 - x) >= limit


@kernel
def step(state, inputs, regs, position_bits):
    x, r = inputs, regs
    a, b, c = x.i_a >> DROP_LIMIT, x.i_b >> DROP_LIMIT, x.i_c >> DROP_LIMIT
    over = 1 if reaches(a, r.i_trip) or reaches(b, r.i_trip) or reaches(c, r.i_trip) else 0
    unbalanced = 1 if reaches(a + b + c, r.sum_trip) else 0

    at_rail = x.current_at_rail != 0 or x.u_dc_at_rail != 0
    railed = min(state.railed + 1, SAMPLES_HI) if at_rail else 0
    stuck = 1 if railed > 0 and railed >= r.rail_samples else 0

    bus = x.u_dc >> DROP_LIMIT
    low = 1 if bus < r.u_dc_min else 0
    high = 1 if bus >= r.u_dc_max else 0

    code = x.code_theta << (TURN_W - position_bits)
    away = wrap_s(code - state.expected, TURN_W)
    off = away >> DROP_JUMP
    known = state.seen == WARM and not r.position_restart
    jumped = 1 if known and reaches(off, r.jump_max) else 0
    expected = wrap(2 * code - state.code, TURN_W)
    seen = 1 if r.position_restart else min(state.seen + 1, WARM)

    faults = over + 2 * unbalanced + 4 * stuck + 8 * low + 16 * high + 32 * jumped
    return State(code, expected, seen, railed), (faults, 1 if faults & ~r.fault_ignore else 0)


def stimuli(rng, config):
    """Each limit met and just missed, with both signs; codes that turn, jump, freeze, pass zero; rails."""
    size = 1 << config["POSITION_BITS"]
    limits = {
        "i_trip": 200,
        "sum_trip": 40,
        "rail_samples": 3,
        "u_dc_min": 30,
        "u_dc_max": 300,
        "jump_max": 64,
    }
    calm = dict.fromkeys(("i_a", "i_b", "i_c", "current_at_rail", "u_dc_at_rail", "code_theta"), 0) | {"u_dc": 40000}
    rows = []
    for edge in (200 << 8, -(200 << 8), 40 << 8, -(40 << 8)):
        for near in (-1, 0, 1):
            rows += [calm | limits | {f"i_{x}": edge + near} for x in "abc"]
            rows.append(calm | limits | {"i_a": 20000, "i_b": -20000, "i_c": edge + near})
    for edge in (30 << 8, 300 << 8):
        rows += [calm | limits | {"u_dc": edge + near} for near in (-1, 0, 1)]
    for length in (1, 2, 3, 4, 20):
        rows += [calm | limits | {"current_at_rail": int(rng.integers(1, 8))} for _ in range(length)]
        rows += [calm | limits] + [calm | limits | {"u_dc_at_rail": 1}] * length + [calm | limits]
    for ignored in range(6):
        rows.append(calm | limits | {"i_b": 60000, "u_dc": 0, "fault_ignore": 1 << ignored})
    code = 0
    for turn in (0, 1, size // 300, -size // 300, size // 120, -size // 120, size // 2, size // 3, 0):
        for _ in range(6):
            code = (code + turn) % size
            rows.append(calm | limits | {"code_theta": code})
        rows += [calm | limits | {"code_theta": code}] * 3
        rows += [calm | limits | {"code_theta": size // 3, "position_restart": 1}]
        rows += [calm | limits | {"code_theta": size // 3 + k * size // 100} for k in (1, 2, 3, 9)]
        rows += [calm | limits | {"code_theta": code, "position_restart": 1}]
    return rows


INPUTS = (
    *(Port(f"i_{x}", PU, doc=f"current, phase {x}") for x in "abc"),
    Port("current_at_rail", Format(0, 3, 0), doc="bit x: ADC code of phase x at either end"),
    Port("u_dc", U_DC, doc="bus voltage"),
    Port("u_dc_at_rail", BIT, doc="bus code at either end"),
    Port("code_theta", Format(0, 0, 16), doc="position code, one mechanical turn"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("i_trip", LIMIT, doc="phase current that trips"),
    Port("sum_trip", LIMIT, doc="sum of the phase currents that trips"),
    Port("rail_samples", SAMPLES, doc="consecutive samples at the rail that trip"),
    Port("u_dc_min", LIMIT, doc="bus voltage below which it trips"),
    Port("u_dc_max", LIMIT, doc="bus voltage that trips"),
    Port("jump_max", JUMP, doc="deviation from the extrapolated position that trips, turns"),
    Port("fault_ignore", IGNORE, doc="bit x: fault x of fault_flags is reported and does not trip"),
    Port("position_restart", BIT, doc="1: the code has nothing to do with the one of the sample before"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="sample_checks",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("sample_faults", CHECKS, doc="faults of this sample, see sample_checks"),
        Port("sample_trip", BIT, doc="1: at least one of them trips"),
    ),
    state=State(),
    latency=4,
    interval=3,
    constants={"DROP_LIMIT": DROP_LIMIT, "DROP_JUMP": DROP_JUMP, "WARM": WARM},
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
