# SPDX-License-Identifier: BSD-3-Clause
"""Gain that makes the fundamental of a clamped modulation the voltage that was asked for, up to six-step.

    m_square  = min(u_d**2 + sum_q**2, u_max**2) / u_dc**2     sum_q = u_pi_q + u_dec_q + u_comp_q;  last sample's u_dc
    gain      = R(m)/m of the table, 1 within the circle       F(R) = m: docs/overmodulation.md
    inverse_used = gain*inverse,  inverse_beta_used = gain*inverse_beta

svm limits each duty to 0..1, which takes a voltage beyond the hexagon to its nearest point.  Over a turn the
fundamental of a vector of length R, the circle u_dc/sqrt(3) being 1, is then F(R) < R, at most 6/(pi*sqrt(3)) = 1.1027.
With R in its place the mean voltage over a sixth of a turn is the one that regulators and estimators know.
The limit of u_q takes a root, its square does not: this is |u_dq|**2 of voltage_limit, eight clocks earlier.

Formats: the sum saturated to PU; square exact, floored to U(0,17); 1/u_dc**2 U(4,14), floored, of 1/u_dc below 4;
product exact; table U(3,13) over m_square in steps of 2**-11; products with the inverse rounded half up, saturated.
"""

import math
from typing import NamedTuple

import numpy as np

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, round_half_up, saturate, saturate_u
from golden_model.formats import PU, PU_W, U_MAX
from golden_model.io.u_dc_processing import INVERSE, INVERSE_W
from golden_model.kernel import kernel

GAIN = Format(0, 3, 13)
ASKED = Format(0, 0, 17)
INVERSE_SQUARE = Format(0, 4, 14)
LATE = 11  # clocks after the first inputs at which the inverses are read
LONGEST = 8.0  # vector of the table's last entry, of the circle
STEP_BITS = 11  # the table's steps are 2**-STEP_BITS of (u/u_dc)**2
DROP_ASKED = 2 * PU.frac_bits - ASKED.frac_bits
SQUARE_FRAC = ASKED.frac_bits + INVERSE_SQUARE.frac_bits
DROP_STEP = SQUARE_FRAC - STEP_BITS
CIRCLE = round((1 << SQUARE_FRAC) / 3)  # (1/sqrt(3))**2
DROP_GAIN = GAIN.frac_bits
DROP_INVERSE = 2  # bits of the inverse that its square leaves out
SHORT = Format(0, 2, INVERSE.frac_bits - DROP_INVERSE)
SHORT_W = SHORT.width
DROP_SQUARE = 2 * SHORT.frac_bits - INVERSE_SQUARE.frac_bits


def fundamental(length: float) -> float:
    """F(R): fundamental of a vector of a length, limited to the nearest point of the hexagon; both of the circle."""
    r = length
    if r <= 1.0:
        return r
    if r < 2.0 / math.sqrt(3.0):
        c = math.acos(1.0 / r)  # up to here the edge cuts, on the rest of its half the vector is inside
        return 6.0 / math.pi * (math.sin(c) + r * (c / 2.0 - math.sin(2.0 * c) / 4.0) + r * (math.pi / 6.0 - c))
    t = math.asin(1.0 / (math.sqrt(3.0) * r))  # from here on the corner holds
    along = r * (t / 2.0 - math.sin(2.0 * t) / 4.0) + (math.cos(t) - math.sqrt(0.75)) / math.sqrt(3.0)
    return 6.0 / math.pi * (0.5 + along)


def length_of(part: float) -> float:
    """The length R <= LONGEST whose fundamental is ``part`` of the circle; LONGEST where none is."""
    low, high = 0.0, LONGEST
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fundamental(middle) < part else (low, middle)
    return high


def gain_of(m_square: float) -> float:
    """R(m)/m for a square of the voltage over the bus voltage; beyond the longest vector's as there."""
    part = min(math.sqrt(3.0 * max(m_square, 0.0)), MOST)
    return 1.0 if part <= 1.0 else length_of(part) / part


MOST = fundamental(LONGEST)  # 1.1017
STEPS = math.ceil((MOST**2 - 1.0) / 3.0 * 2**STEP_BITS)
MIDDLES = (*(1.0 / 3.0 + (k + 0.5) / 2**STEP_BITS for k in range(STEPS - 1)), 1.0)  # the last step: all beyond
GAINS = (1 << DROP_GAIN, *(GAIN.to_int(gain_of(m)) for m in MIDDLES))


class State(NamedTuple):
    inverse_square: int = 0  # INVERSE_SQUARE, of the last sample's bus voltage


@kernel
def step(state, u_d, u_pi_q, u_dec_q, u_comp_q, u_max, inverse, inverse_beta):
    sum_q = saturate(u_pi_q + u_dec_q + u_comp_q, PU_W)
    asked = min(u_d * u_d + sum_q * sum_q, u_max * u_max) >> DROP_ASKED
    beyond = asked * state.inverse_square - CIRCLE
    index = 0 if beyond < 0 else clamp((beyond >> DROP_STEP) + 1, 1, STEPS)
    gain = GAINS[index]
    inverse_used = saturate_u(round_half_up(inverse * gain, DROP_GAIN), INVERSE_W)
    inverse_beta_used = saturate_u(round_half_up(inverse_beta * gain, DROP_GAIN), INVERSE_W)
    short = saturate_u(inverse >> DROP_INVERSE, SHORT_W)
    return State((short * short) >> DROP_SQUARE), (inverse_used, inverse_beta_used)


def asked_square(v, state):
    """Square of the voltage over that of the bus as the state knows it."""
    sum_q = PU.limit(v["u_pi_q"] + v["u_dec_q"] + v["u_comp_q"])
    return min(v["u_d"] ** 2 + sum_q**2, v["u_max"] ** 2) * state.inverse_square * INVERSE_SQUARE.lsb


def reference(v, state):
    gain = gain_of(asked_square(v, state))
    return {f"{name}_used": INVERSE.limit(v[name] * gain) for name in ("inverse", "inverse_beta")}


def bound(v, state):
    """The gain's change over a step of the table and the floor of the square, each way; then both roundings."""
    at = asked_square(v, state)
    wide = 2.0**-STEP_BITS + ASKED.lsb * state.inverse_square * INVERSE_SQUARE.lsb
    change = gain_of(at + wide) - gain_of(at - wide) + GAIN.lsb
    return {f"{name}_used": v[name] * change + INVERSE.lsb for name in ("inverse", "inverse_beta")}


def stimuli(rng, _config):
    """Within the circle, over each step of the table to the LSB and beyond its end, at several bus voltages."""
    rest = dict.fromkeys(("u_dec_q", "u_comp_q"), 0)
    rows = []
    for u_dc in (0.24, 0.3, 1.0, 1.37, 1.55):
        inverse = min(round(131072 / u_dc), INVERSE.hi)
        bus = {
            "inverse": inverse,
            "inverse_beta": inverse * 7 // 8,
            "u_max": min(round(65536 * 0.63605 * u_dc), U_MAX.hi),
        }
        for part in (0.0, 0.5, 0.999, 1.0, 1.001, *np.linspace(1.0, 1.12, 60).tolist()):
            size, angle = 65536 * part * u_dc / math.sqrt(3.0), rng.uniform(0.0, 2.0 * math.pi)
            d, q = round(size * math.cos(angle)), round(size * math.sin(angle))
            d = min(max(d, -U_MAX.hi), U_MAX.hi - 1)
            rows += [{**rest, **bus, "u_d": d + e, "u_pi_q": q, "u_dec_q": e, "u_comp_q": -e} for e in (0, 1)]
    ends = {"u_d": -U_MAX.hi, "u_pi_q": PU.lo, "u_dec_q": PU.lo, "u_comp_q": -1}
    rows += [
        {**ends, "u_max": u, "inverse": i, "inverse_beta": i} for u in (0, 1, U_MAX.hi) for i in (1, 131072, INVERSE.hi)
    ]
    return rows


BLOCK = Block(
    name="overmodulation",
    folder="modulation",
    paper="none: docs/overmodulation.md",
    step=step,
    inputs=(
        Port(
            "u_d",
            PU,
            lo=-U_MAX.hi,
            hi=U_MAX.hi,
            late=2,
            doc="voltage, d axis, early in voltage_limit",
        ),
        Port("u_pi_q", PU, late=1, doc="output of the current regulator, q axis"),
        Port("u_dec_q", PU, late=1, doc="rotational voltage, q axis"),
        Port("u_comp_q", PU, late=1, doc="compensation voltage, q axis"),
        Port("u_max", U_MAX, doc="radius of the voltage circle"),
        Port("inverse", INVERSE, late=LATE, doc="1/u_dc"),
        Port("inverse_beta", INVERSE, late=LATE, doc="sqrt(3)/2/u_dc"),
    ),
    outputs=(
        Port("inverse_used", INVERSE, doc="1/u_dc times the gain of the over-modulation"),
        Port("inverse_beta_used", INVERSE, doc="sqrt(3)/2/u_dc times the gain of the over-modulation"),
    ),
    state=State(),
    latency=14,
    interval=14,
    constants={
        "DROP_ASKED": DROP_ASKED,
        "ASKED_W": ASKED.width,
        "SQUARE_W": INVERSE_SQUARE.width,
        "CIRCLE": CIRCLE,
        "DROP_STEP": DROP_STEP,
        "STEPS": STEPS,
        "DROP_GAIN": DROP_GAIN,
        "DROP_INVERSE": DROP_INVERSE,
        "SHORT_W": SHORT_W,
        "GAIN_BITS": GAIN.width,
        "DROP_SQUARE": DROP_SQUARE,
    },
    roms={"GAINS": (GAIN, list(GAINS))},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
