# SPDX-License-Identifier: BSD-3-Clause
"""1/x as m * 2**n, one quotient bit per clock, outside the data path.

    1 / x = m * 2**n * 2**-17          m in (2**16, 2**17), n in 0..N_MAX

Method: n shifts bring x into [1, 2); m is the rounded quotient.
Error bound: |m*2**n*2**-17 * x - 1| <= 2**-17 over the whole range (half an LSB of m >= 2**16; one LSB
at x = 2**-n, where 2**17 is stored as 2**17 - 1).
Range: an x below 2**-N_MAX is replaced by 2**-N_MAX and ``low`` is 1: the reciprocal is then
too small, never too large.
"""

import math

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up
from golden_model.formats import BIT, RECIPROCAL, U_DC
from golden_model.kernel import kernel

X = U_DC
MANTISSA_ONE = 1 << X.frac_bits
M_MAX = (1 << RECIPROCAL.width) - 1
QUOTIENT_BITS = RECIPROCAL.width + 1  # one more than m, for rounding
NUMERATOR = 1 << (X.frac_bits + QUOTIENT_BITS)
SHIFT = Format(0, 4, 0)


@kernel
def step(x, n_max):
    least = MANTISSA_ONE >> n_max
    low = 1 if x < least else 0
    mantissa = max(x, least)
    n = 0
    while mantissa < MANTISSA_ONE:
        mantissa <<= 1
        n += 1
    quotient = min(NUMERATOR // mantissa, (1 << QUOTIENT_BITS) - 1)
    m = min(round_half_up(quotient, 1), M_MAX)
    return m, n, low


def reference(v, _state):
    x = max(v["x"], 2.0 ** -v["N_MAX"])
    n = max(0, -math.floor(math.log2(x)))
    return {"m": 1.0 / (x * 2.0**n)}


def bound(_v, _state):
    return {"m": RECIPROCAL.lsb}


def stimuli(_rng, _config):
    """Zero, the floor, every power of two and its neighbours, full scale."""
    edges = [0, 1, X.hi] + [(1 << k) + d for k in range(2, 17) for d in (-1, 0, 1)]
    return [{"x": x} for x in edges]


BLOCK = Block(
    name="reciprocal",
    folder="common",
    paper="001, section 5.2, U_dc processing: division by 2**n / m",
    step=step,
    inputs=(Port("x", X, doc="what to divide by"),),
    outputs=(
        Port("m", RECIPROCAL, doc="mantissa of 1/x"),
        Port("n", SHIFT, doc="exponent of 1/x"),
        Port("low", BIT, doc="x below 2**-N_MAX"),
    ),
    latency=21,
    interval=21,
    constants={"QUOTIENT_BITS": QUOTIENT_BITS},
    configs=({"N_MAX": 5}, {"N_MAX": 12}),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
