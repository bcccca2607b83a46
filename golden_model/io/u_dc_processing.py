# SPDX-License-Identifier: BSD-3-Clause
"""U_dc as 2**n / m, so that the modulator multiplies instead of dividing.

    inverse      = 1 / u_dc = m * 2**n * 2**-17            m and n: see common/reciprocal
    inverse_beta = m_beta * 2**n * 2**-17,  m_beta = m * sqrt(3)/2    for the beta axis of the modulator

Both are calculated in parallel to the data path and are ready before the modulator starts.
Error bound: |inverse * u_dc - 1| <= 2**-17 over the whole range.
Range: a bus voltage below 1/32 per unit is replaced by 1/32 and ``u_dc_low`` is 1: the duties are then
too small, never too large.
Formats: m, m_beta U(0,17); inverse, inverse_beta U(5,17).
Rounding: m_beta half up; it is below m, so it fits.  The shift by n loses nothing.
"""

import math

from golden_model.block import Block, Const, Port
from golden_model.common import reciprocal
from golden_model.fixed import Format, round_half_up
from golden_model.formats import BIT, RECIPROCAL, U_DC
from golden_model.kernel import kernel

N_MAX = 5
INVERSE = Format(0, N_MAX, RECIPROCAL.frac_bits)
INVERSE_W = INVERSE.width
AFTER = 5  # clocks from the reciprocal to the outputs
U_DC_MIN = 1 << (U_DC.frac_bits - N_MAX)
SQRT3_2 = Const(math.sqrt(3) / 2, Format(0, 0, 17))
K_SQRT3_2 = SQRT3_2.value
DROP_BETA = SQRT3_2.fmt.frac_bits


@kernel
def step(u_dc):
    m, n, low = reciprocal.step(u_dc, N_MAX)
    m_beta = round_half_up(m * K_SQRT3_2, DROP_BETA)
    part, part_beta = m << n % 4, m_beta << n % 4
    inverse, inverse_beta = part << n - n % 4, part_beta << n - n % 4
    return inverse, inverse_beta, low


def reference(v, _state):
    inverse = 1.0 / max(v["u_dc"], U_DC_MIN * U_DC.lsb)
    return {"inverse": inverse, "inverse_beta": inverse * math.sqrt(3) / 2}


def bound(v, _state):
    u_dc = max(v["u_dc"], U_DC_MIN * U_DC.lsb)
    scale = 2.0 ** max(0, -math.floor(math.log2(u_dc)))
    m = RECIPROCAL.lsb * scale
    beta = m * math.sqrt(3) / 2 + (RECIPROCAL.lsb + SQRT3_2.fmt.lsb) / 2 * scale
    return {"inverse": m, "inverse_beta": beta}


def stimuli(_rng, _config):
    """Zero, the floor, every power of two and its neighbours, full scale."""
    edges = [0, 1, U_DC.hi] + [(1 << k) + d for k in range(10, 17) for d in (-1, 0, 1)]
    return [{"u_dc": u} for u in edges]


BLOCK = Block(
    name="u_dc_processing",
    folder="io",
    paper="001, section 5.2, U_dc processing",
    step=step,
    inputs=(Port("u_dc", U_DC, doc="bus voltage"),),
    outputs=(
        Port("inverse", INVERSE, doc="1/u_dc"),
        Port("inverse_beta", INVERSE, doc="sqrt(3)/2/u_dc"),
        Port("u_dc_low", BIT, doc="bus below 1/32 per unit"),
    ),
    latency=reciprocal.BLOCK.latency + AFTER,
    interval=reciprocal.BLOCK.interval + AFTER,
    constants={
        "N_MAX": N_MAX,
        "U_DC_MIN": U_DC_MIN,
        "SQRT3_2": SQRT3_2,
        "DROP_BETA": DROP_BETA,
        "INVERSE_W": INVERSE_W,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
