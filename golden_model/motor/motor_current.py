# SPDX-License-Identifier: BSD-3-Clause
"""The currents: those of a linear machine plus what saturation adds, between four points of the map; then the phases.

    lo = m_00 + (m_01 - m_00)*f_q,  hi = m_10 + (m_11 - m_10)*f_q       for each axis
    i  = x + lo + (hi - lo)*f_d
    i_alpha = i_d*cos - i_q*sin,  i_beta = i_q*cos + i_d*sin
    i_a = i_alpha,  i_b, i_c = -i_alpha/2 +- sqrt(3)/2*i_beta

A map of zeros is the linear machine.  m_RC: R is the row (d axis), C the column (q axis) from the cell's first point.
Formats: x S(1,22), m S(0,17), f U(0,17), lo and hi 21 fraction bits, i PU.  Products half up, sums saturate.
"""

import math
from collections import namedtuple

from golden_model.block import Block, Const, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.common.sum_of_products import difference_of_products, sum_of_products
from golden_model.fixed import Format, round_half_up, round_sat, saturate
from golden_model.formats import FLUX, MOTOR_TRIG, PU, PU_W
from golden_model.kernel import kernel
from golden_model.motor.motor_unsaturated import PLACE, X

POINT = Format(1, 0, 17)
FINER = 4  # bits of the interpolation below a point of the map
BETWEEN_W = POINT.width + FINER + 1
DROP_FIRST = PLACE.frac_bits - FINER
DROP_SECOND = PLACE.frac_bits
TO_X = X.frac_bits - POINT.frac_bits - FINER
DROP_I = X.frac_bits - PU.frac_bits
DROP = MOTOR_TRIG.frac_bits
HALF_SQRT3 = Const(math.sqrt(3.0) / 2, Format(1, 0, 17))
BY_HALF_SQRT3, DROP_BETA = HALF_SQRT3.value, 17
LATE = 3  # clocks from the cell to the points


@kernel
def axis(x, points, f_d, f_q):
    """Current of an axis from its four points 00, 01, 10, 11."""
    m_00, m_01, m_10, m_11 = points
    lo, _ = multiply_add(m_01 - m_00, f_q, m_00 << FINER, DROP_FIRST, BETWEEN_W)
    hi, _ = multiply_add(m_11 - m_10, f_q, m_10 << FINER, DROP_FIRST, BETWEEN_W)
    more, _ = multiply_add(hi - lo, f_d, lo, DROP_SECOND, BETWEEN_W)
    return round_sat(x + (more << TO_X), DROP_I, PU_W)


@kernel
def step(inputs):
    x = inputs
    i_d = axis(x.x_d, (x.d_00, x.d_01, x.d_10, x.d_11), x.f_d, x.f_q)
    i_q = axis(x.x_q, (x.q_00, x.q_01, x.q_10, x.q_11), x.f_d, x.f_q)
    i_beta = sum_of_products(i_d, x.sin_theta, i_q, x.cos_theta, DROP, PU_W)
    i_alpha = difference_of_products(i_q, x.sin_theta, i_d, x.cos_theta, DROP, PU_W)
    half, across = round_half_up(i_alpha, 1), round_half_up(i_beta * BY_HALF_SQRT3, DROP_BETA)
    i_b, i_c = saturate(across - half, PU_W), saturate(-across - half, PU_W)
    return i_d, i_q, i_alpha, i_b, i_c, x.turn_d_in, x.turn_q_in


def reference(v, _state):
    current, f_d, f_q = {}, v["f_d"], v["f_q"]
    for name in "dq":
        m_00, m_01, m_10, m_11 = (v[f"{name}_{k}"] for k in ("00", "01", "10", "11"))
        lo, hi = m_00 + (m_01 - m_00) * f_q, m_10 + (m_11 - m_10) * f_q
        current[name] = PU.limit(v[f"x_{name}"] + lo + (hi - lo) * f_d)
    c, s = v["cos_theta"], v["sin_theta"]
    alpha = PU.limit(current["d"] * c - current["q"] * s)
    beta = PU.limit(current["q"] * c + current["d"] * s)
    across = math.sqrt(3.0) / 2 * beta
    return {
        "i_d": current["d"],
        "i_q": current["q"],
        "i_a": alpha,
        "i_b": PU.limit(across - alpha / 2),
        "i_c": PU.limit(-across - alpha / 2),
        "turn_d": v["turn_d_in"],
        "turn_q": v["turn_q_in"],
    }


def bound(v, _state):
    """Three roundings at 21 fraction bits and that of i; their rotation; the constant at the largest i_beta."""
    i = PU.lsb / 2 + 1.5 * 2.0 ** -(POINT.frac_bits + FINER)
    turned = i * (abs(v["cos_theta"]) + abs(v["sin_theta"])) + PU.lsb / 2
    phase = 1.5 * turned + PU.lsb + 2 * HALF_SQRT3.fmt.lsb
    return {"i_d": i, "i_q": i, "i_a": turned, "i_b": phase, "i_c": phase, "turn_d": 0.0, "turn_q": 0.0}


def stimuli(_rng, _config):
    """Each point alone, at both ends of each place; currents at their limits, at each eighth of a turn."""
    still = {p.name: 0 for p in BLOCK.inputs}
    rows = []
    for name in "dq":
        for k in ("00", "01", "10", "11"):
            for f in (0, 1, 1 << 16, PLACE.hi):
                for point in (POINT.lo, POINT.hi, 1):
                    other = {"f_d": PLACE.hi - f, "f_q": f}
                    rows += [still | {f"{name}_{k}": point, "f_d": f, "f_q": f}, still | {f"{name}_{k}": point} | other]
    for k in range(8):
        c, s = (round(MOTOR_TRIG.hi * f(k * math.pi / 4)) for f in (math.cos, math.sin))
        for x_d, x_q in ((X.hi, 0), (0, X.lo), (X.lo, X.lo), (X.hi, X.hi), (1 << 21, -(1 << 21))):
            ends = {
                f"{n}_{r}": POINT.hi if v > 0 else POINT.lo for n, v in (("d", x_d), ("q", x_q)) for r in ("00", "11")
            }
            rows.append(still | ends | {"x_d": x_d, "x_q": x_q, "cos_theta": c, "sin_theta": s})
    return rows


POINTS = tuple(
    Port(f"{name}_{r}{c}", POINT, late=LATE, doc=f"what saturation adds to i_{name}: row {r}, column {c} of the cell")
    for name in "dq"
    for r in "01"
    for c in "01"
)
INPUTS = (
    Port("x_d", X, doc="current without saturation, d axis"),
    Port("x_q", X, doc="current without saturation, q axis"),
    Port("f_d", PLACE, doc="place in the cell, d axis"),
    Port("f_q", PLACE, doc="place in the cell, q axis"),
    Port("cos_theta", MOTOR_TRIG, doc="cosine of the electrical angle"),
    Port("sin_theta", MOTOR_TRIG, doc="sine of the electrical angle"),
    Port("turn_d_in", FLUX, doc="flux that makes torque with i_q"),
    Port("turn_q_in", FLUX, doc="flux that makes torque with -i_d"),
    *POINTS,
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])

BLOCK = Block(
    name="motor_current",
    folder="motor",
    paper="docs/hil.md: currents from fluxes",
    step=step,
    takes=(Inputs,),
    inputs=INPUTS,
    outputs=(
        Port("i_d", PU, doc="current, d axis"),
        Port("i_q", PU, doc="current, q axis"),
        *(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in "abc"),
        Port("turn_d", FLUX, doc="turn_d_in of this step"),
        Port("turn_q", FLUX, doc="turn_q_in of this step"),
    ),
    latency=19,
    interval=16,
    constants={
        "FINER": FINER,
        "DROP_FIRST": DROP_FIRST,
        "DROP_SECOND": DROP_SECOND,
        "TO_X": TO_X,
        "DROP_I": DROP_I,
        "DROP": DROP,
        "HALF_SQRT3": HALF_SQRT3,
        "DROP_BETA": DROP_BETA,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
