# SPDX-License-Identifier: BSD-3-Clause
"""What follows from the rotor's angle: sine, cosine, harmonic fluxes and their slopes, cogging torque.

    theta_e = quadrant + (address + 1/2)/4096 + delta;  sin = S + delta*C,  cos = C - delta*S      as in `sincos`
    h     = w_0 + (w_1 - w_0)*f              w: words of the table on both sides of the angle, f: place between them
    slope = (w_1 - w_0)*POINTS/(2*pi)        of the same straight line, so that the harmonics make no energy
    cogging = c_0 + (c_1 - c_0)*f            over the mechanical turn

Formats: angles in turns U(0,25), of which sine and cosine take 20 bits; table U(0,18) of `sincos`, delta S(-10,24),
products floored to 22 fraction bits; sine and cosine S(0,17) half up, 1 becomes 1 - 2**-17.  Words S(-2,19), f U(0,15),
h and cogging half up; slope PU, POINTS/(2*pi) U(8,9), half up, saturated.
"""

import math
from collections import namedtuple

import numpy as np

from golden_model.block import Block, Const, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.fixed import Format, round_sat
from golden_model.formats import MOTOR_ANGLE, MOTOR_TRIG, MOTOR_WAVE, PU, PU_W
from golden_model.kernel import kernel
from golden_model.transforms.sincos import ADDRESS_BITS, FRAC, SINE, TABLE, TABLE_SHIFT

POINTS_BITS = 10  # of a table over a turn
POINTS = 1 << POINTS_BITS
F_BITS = MOTOR_ANGLE.width - POINTS_BITS
DELTA_BITS = 8
UNUSED = MOTOR_ANGLE.width - 2 - ADDRESS_BITS - DELTA_BITS
DELTA = Format(1, -10, 24)
DROP_PROD = TABLE.frac_bits + DELTA.frac_bits - FRAC
DROP_TRIG = FRAC - MOTOR_TRIG.frac_bits
SLOPE = Const(POINTS / (2 * math.pi), Format(0, 8, 9))
DROP_SLOPE = MOTOR_WAVE.frac_bits + 9 - PU.frac_bits
TRIG_W, WAVE_W, BY_SLOPE = MOTOR_TRIG.width, MOTOR_WAVE.width, SLOPE.value
_HALF = 1 << (DELTA_BITS - 1)
_STEP = 2 * math.pi / (1 << (2 + ADDRESS_BITS + DELTA_BITS))
DELTA_ROM = tuple(DELTA.to_int((k + 0.5 - _HALF) * _STEP) for k in range(1 << DELTA_BITS))
DELTAS = np.array(DELTA_ROM)
LATE = 3  # clocks from the angle to the words of the tables


@kernel
def turn(theta):
    """(cosine, sine) of an angle."""
    fine = theta >> UNUSED
    quadrant = fine >> (ADDRESS_BITS + DELTA_BITS)
    address = (fine >> DELTA_BITS) & ((1 << ADDRESS_BITS) - 1)
    s, c = SINE[address], SINE[(1 << ADDRESS_BITS) - 1 - address]
    delta = DELTAS[fine & ((1 << DELTA_BITS) - 1)]
    fine_s = (s << TABLE_SHIFT) + ((delta * c) >> DROP_PROD)
    fine_c = (c << TABLE_SHIFT) - ((delta * s) >> DROP_PROD)
    if quadrant == 0:
        sin, cos = fine_s, fine_c
    elif quadrant == 1:
        sin, cos = fine_c, -fine_s
    elif quadrant == 2:
        sin, cos = -fine_s, -fine_c
    else:
        sin, cos = -fine_c, fine_s
    return round_sat(cos, DROP_TRIG, TRIG_W), round_sat(sin, DROP_TRIG, TRIG_W)


@kernel
def between(before, after, f):
    """The value at f/2**F_BITS of the way from one word to the next."""
    value, _ = multiply_add(after - before, f, before, F_BITS, WAVE_W)
    return value


@kernel
def slope(before, after):
    """Its slope per radian."""
    value, _ = multiply_add(after - before, BY_SLOPE, 0, DROP_SLOPE, PU_W)
    return value


@kernel
def step(inputs):
    x = inputs
    cos_theta, sin_theta = turn(x.theta_e)
    f_e, f_m = x.theta_e & ((1 << F_BITS) - 1), x.theta_m & ((1 << F_BITS) - 1)
    wave_d, wave_q = between(x.wave_d_0, x.wave_d_1, f_e), between(x.wave_q_0, x.wave_q_1, f_e)
    slope_d, slope_q = slope(x.wave_d_0, x.wave_d_1), slope(x.wave_q_0, x.wave_q_1)
    return cos_theta, sin_theta, wave_d, wave_q, slope_d, slope_q, between(x.cog_0, x.cog_1, f_m)


def reference(v, _state):
    angle, f = 2 * math.pi * v["theta_e"], POINTS * v["theta_e"] % 1
    result = {"cos_theta": math.cos(angle), "sin_theta": math.sin(angle)}
    for axis in "dq":
        rise = v[f"wave_{axis}_1"] - v[f"wave_{axis}_0"]
        result[f"wave_{axis}"] = v[f"wave_{axis}_0"] + rise * f
        result[f"slope_{axis}"] = PU.limit(rise * POINTS / (2 * math.pi))
    return result | {"cogging": v["cog_0"] + (v["cog_1"] - v["cog_0"]) * (POINTS * v["theta_m"] % 1)}


def bound(_v, _state):
    """Trig: rounding, 1 stored as 1 - 2**-17, table, unused bits, delta's square; slope: factor at a full rise."""
    half_delta = _STEP * _HALF
    trig = MOTOR_TRIG.lsb + TABLE.lsb + _STEP / 2 + half_delta**2 / 2 + DELTA.lsb / 2 + 2.0**-FRAC
    along = PU.lsb / 2 + SLOPE.fmt.lsb / 2 * 0.5
    return {
        **dict.fromkeys(("cos_theta", "sin_theta"), trig),
        **dict.fromkeys(("wave_d", "wave_q", "cogging"), MOTOR_WAVE.lsb / 2),
        **dict.fromkeys(("slope_d", "slope_q"), along),
    }


def stimuli(rng, _config):
    """Both sides of every quadrant's border and of 64 others; words at both ends and one apart."""
    size, lo, hi = 1 << MOTOR_ANGLE.width, MOTOR_WAVE.lo, MOTOR_WAVE.hi
    pairs = [(lo, hi), (hi, lo), (lo, lo), (hi, hi), (0, 1), (1, 0), (-1, 0), (700, 900), (900, 700)]
    rows = []
    for k in range(64):
        for d in (-1, 0, 1):
            (a, b), (c, e), (g, h) = (pairs[int(n)] for n in rng.integers(len(pairs), size=3))
            rows.append(
                {
                    "theta_e": (k * size // 64 + d) % size,
                    "theta_m": (k * size // 64 - d) % size,
                    "wave_d_0": a,
                    "wave_d_1": b,
                    "wave_q_0": c,
                    "wave_q_1": e,
                    "cog_0": g,
                    "cog_1": h,
                }
            )
    return rows


INPUTS = (
    Port("theta_e", MOTOR_ANGLE, doc="electrical angle"),
    Port("theta_m", MOTOR_ANGLE, doc="mechanical angle"),
    *(
        Port(f"wave_{axis}_{k}", MOTOR_WAVE, late=LATE, doc=f"harmonic flux, {axis} axis, table word {side} the angle")
        for axis in "dq"
        for k, side in enumerate(("before", "after"))
    ),
    *(
        Port(f"cog_{k}", MOTOR_WAVE, late=LATE, doc=f"cogging torque, table word {side} the angle")
        for k, side in enumerate(("before", "after"))
    ),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])

BLOCK = Block(
    name="motor_angle",
    folder="motor",
    paper="docs/hil.md: what follows from the rotor's angle",
    step=step,
    takes=(Inputs,),
    inputs=INPUTS,
    outputs=(
        Port("cos_theta", MOTOR_TRIG, doc="cosine of the electrical angle"),
        Port("sin_theta", MOTOR_TRIG, doc="sine of the electrical angle"),
        Port("wave_d", MOTOR_WAVE, doc="harmonic flux, d axis"),
        Port("wave_q", MOTOR_WAVE, doc="harmonic flux, q axis"),
        Port("slope_d", PU, doc="slope of wave_d per electrical radian"),
        Port("slope_q", PU, doc="slope of wave_q per electrical radian"),
        Port("cogging", MOTOR_WAVE, doc="cogging torque"),
    ),
    latency=10,
    interval=8,
    constants={
        "F_BITS": F_BITS,
        "DELTA_BITS": DELTA_BITS,
        "DROP_PROD": DROP_PROD,
        "DROP_TRIG": DROP_TRIG,
        "DROP_SLOPE": DROP_SLOPE,
        "SLOPE": SLOPE,
    },
    roms={"DELTA": (DELTA, list(DELTA_ROM))},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
