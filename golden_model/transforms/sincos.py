# SPDX-License-Identifier: BSD-3-Clause
"""Sine and cosine of two angles, one after the other, from an interpolated quarter-wave table of 1024 entries.

    theta = quadrant + (address + 1/2)/4096 + delta          turns, |delta| < 2**-13
    sin   = S + delta*C,  cos = C - delta*S                  S, C from the table at both ends

Formats: table U(0,18) (its last entry, 1 - 3e-7, is stored as 1 - 2**-18); delta in radians
S(-10,22) from a table of 64; product floored to 22 fraction bits; result rounded half up to TRIG.
Error: half an LSB of TRIG and of the table (a whole one for the last entry), the quadratic term
delta**2/2, the floor and the rounding of delta: below 1.4e-5, see bound().  No saturation is reachable.
"""

import math

import numpy as np

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up
from golden_model.formats import TRIG, TRIG_ONE, TURN, TURN_W
from golden_model.kernel import kernel

ADDRESS_BITS = 10
DELTA_BITS = TURN_W - 2 - ADDRESS_BITS
TABLE = Format(0, 0, 18)
DELTA = Format(1, -10, 22)
FRAC = 22  # of the interpolated value
DROP_PROD = TABLE.frac_bits + DELTA.frac_bits - FRAC
TABLE_SHIFT = FRAC - TABLE.frac_bits
DROP_OUT = FRAC - TRIG.frac_bits

_N = 1 << ADDRESS_BITS
SINE_ROM = tuple(TABLE.to_int(math.sin((k + 0.5) * math.pi / 2 / _N)) for k in range(_N))
_HALF = 1 << (DELTA_BITS - 1)
DELTA_ROM = tuple(DELTA.to_int((k - _HALF) * 2 * math.pi * TURN.lsb) for k in range(1 << DELTA_BITS))

SINE, DELTAS = np.array(SINE_ROM), np.array(DELTA_ROM)


@kernel
def turn(theta):
    """(cosine, sine) of one angle."""
    quadrant = theta >> (TURN_W - 2)
    address = (theta >> DELTA_BITS) & ((1 << ADDRESS_BITS) - 1)
    low = theta & ((1 << DELTA_BITS) - 1)
    s = SINE[address]
    c = SINE[(1 << ADDRESS_BITS) - 1 - address]
    delta = DELTAS[low]
    prod_s = delta * c
    prod_c = delta * s
    fine_s = (s << TABLE_SHIFT) + (prod_s >> DROP_PROD)
    fine_c = (c << TABLE_SHIFT) - (prod_c >> DROP_PROD)
    if quadrant == 0:
        sin, cos = fine_s, fine_c
    elif quadrant == 1:
        sin, cos = fine_c, -fine_s
    elif quadrant == 2:
        sin, cos = -fine_s, -fine_c
    else:
        sin, cos = -fine_c, fine_s
    return round_half_up(cos, DROP_OUT), round_half_up(sin, DROP_OUT)


@kernel
def step(theta_me, theta_out):
    cos_theta, sin_theta = turn(theta_me)
    cos_out, sin_out = turn(theta_out)
    return cos_theta, sin_theta, cos_out, sin_out


def reference(v, _state):
    now, then = 2 * math.pi * v["theta_me"], 2 * math.pi * v["theta_out"]
    return {
        "cos_theta": math.cos(now),
        "sin_theta": math.sin(now),
        "cos_out": math.cos(then),
        "sin_out": math.sin(then),
    }


def bound(_v, _state):
    half_delta = math.pi * TURN.lsb * (1 << DELTA_BITS)
    error = TRIG.lsb / 2 + TABLE.lsb + half_delta**2 / 2 + DELTA.lsb / 2 + 2.0**-FRAC + half_delta * TABLE.lsb
    return dict.fromkeys(("cos_theta", "sin_theta", "cos_out", "sin_out"), error)


def stimuli(_rng, _config):
    """Both sides of every quadrant border and of 64 table borders; the second angle is about half a turn away."""
    size = 1 << TURN_W
    return [
        {"theta_me": (k * size // 64 + d) % size, "theta_out": (k * size // 64 + size // 2 - 3 * d) % size}
        for k in range(64)
        for d in (-1, 0, 1)
    ]


OUT = {"lo": -TRIG_ONE, "hi": TRIG_ONE}
PASS = 5  # clocks for one angle
SECOND = 8  # clocks from the first angle to the second, which needs the speed of this sample

BLOCK = Block(
    name="sincos",
    folder="transforms",
    paper="001, eq. (12)",
    step=step,
    inputs=(
        Port("theta_me", TURN, doc="electrical angle of the sample"),
        Port("theta_out", TURN, late=SECOND, doc="angle at which the voltage will act"),
    ),
    outputs=(
        Port("cos_theta", TRIG, doc="cosine of theta_me", **OUT),
        Port("sin_theta", TRIG, doc="sine of theta_me", **OUT),
        Port("cos_out", TRIG, doc="cosine of theta_out", **OUT),
        Port("sin_out", TRIG, doc="sine of theta_out", **OUT),
    ),
    latency=SECOND + PASS,
    interval=SECOND + 1,
    soon=("cos_theta", "sin_theta"),
    ahead=SECOND,
    constants={
        "SECOND": SECOND,
        "ADDRESS_BITS": ADDRESS_BITS,
        "DROP_PROD": DROP_PROD,
        "TABLE_SHIFT": TABLE_SHIFT,
        "DROP_OUT": DROP_OUT,
    },
    roms={
        "SINE": (TABLE, list(SINE_ROM)),
        "DELTA": (DELTA, list(DELTA_ROM)),
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
