# SPDX-License-Identifier: BSD-3-Clause
"""Three phase currents to the stator frame, amplitude-invariant; no zero-sum is assumed.

    i_alpha = (2*i_a - i_b - i_c) / 3
    i_beta  = (i_b - i_c) / sqrt(3) = (2*i_b - 2*i_c) / sqrt(12)

Both have the same form, so that one multiplier takes beta and then alpha.
Formats: sums exact; times 1/3 and 1/sqrt(12) as S(0,-1,18), relative error 4e-6 each; rounded half up to PU.
Limit: +-1.375 per unit (VECTOR), so that park needs no limiter; the base is the measuring range of the sensor, and
currents that sum to zero give no component beyond the largest of them.
"""

import math

from golden_model.block import Block, Const, Port
from golden_model.fixed import Format, clamp, round_half_up
from golden_model.formats import PU, VECTOR
from golden_model.kernel import kernel

THIRD = Const(1 / 3, Format(0, -1, 18))
INV_SQRT12 = Const(1 / math.sqrt(12), Format(0, -1, 18))
K_THIRD, K_INV_SQRT12 = THIRD.value, INV_SQRT12.value
DROP = THIRD.fmt.frac_bits


@kernel
def limited(x):
    return clamp(x, -VECTOR, VECTOR - 1)


@kernel
def component(sum_of_phases, factor):
    return limited(round_half_up(sum_of_phases * factor, DROP))


@kernel
def step(i_a, i_b, i_c):
    both = i_b + i_c
    i_beta = component(2 * i_b - 2 * i_c, K_INV_SQRT12)
    i_alpha = component(2 * i_a - both, K_THIRD)
    return i_alpha, i_beta


def reference(v, _state):
    alpha = (2 * v["i_a"] - v["i_b"] - v["i_c"]) / 3
    beta = (v["i_b"] - v["i_c"]) / math.sqrt(3)
    low, high = I_ALPHA.low * PU.lsb, I_ALPHA.high * PU.lsb
    return {"i_alpha": clamp(alpha, low, high), "i_beta": clamp(beta, low, high)}


def bound(v, _state):
    """Half an LSB of the output plus the coefficient's rounding times the sum."""
    alpha = abs(2 * v["i_a"] - v["i_b"] - v["i_c"]) * THIRD.fmt.lsb / 2
    beta = abs(2 * v["i_b"] - 2 * v["i_c"]) * INV_SQRT12.fmt.lsb / 2
    return {"i_alpha": PU.lsb / 2 + alpha, "i_beta": PU.lsb / 2 + beta}


I_ALPHA = Port("i_alpha", PU, -VECTOR, VECTOR - 1, doc="current, alpha")
I_BETA = Port("i_beta", PU, -VECTOR, VECTOR - 1, doc="current, beta")

BLOCK = Block(
    name="clarke",
    folder="transforms",
    paper="001, eq. (1): stator frame",
    step=step,
    inputs=tuple(Port(f"i_{x}", PU, late=int(x == "a"), doc=f"current, phase {x}") for x in "abc"),
    outputs=(I_ALPHA, I_BETA),
    latency=5,
    soon=("i_beta",),
    interval=2,
    constants={
        "THIRD": THIRD,
        "INV_SQRT12": INV_SQRT12,
        "DROP": DROP,
        "VECTOR": VECTOR,
    },
    reference=reference,
    bound=bound,
)
