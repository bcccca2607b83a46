"""U_dc as 2**n / m, so that the modulator multiplies where it would divide.

    1 / u_dc = m * 2**n * 2**-17       see common/reciprocal
    m_beta   = m * sqrt(3)/2           what the beta axis needs in the modulator

m is made beside the data path; it is ready long before the modulator asks.
Error bound: |m*2**n*2**-17 * u_dc - 1| <= 2**-17 over the whole range.
Range: below 1/32 per unit the bus is taken for 1/32 and ``u_dc_low`` is raised: the duties then come
out smaller than asked, never larger.
Rounding: m_beta half up; it is below m, so it fits.
"""

import math

from golden_model.block import Block, Const, Port
from golden_model.common import reciprocal
from golden_model.fixed import Format, round_half_up
from golden_model.formats import BIT, RECIPROCAL, U_DC
from golden_model.kernel import kernel

N_MAX = 5
U_DC_MIN = 1 << (U_DC.frac_bits - N_MAX)
SQRT3_2 = Const(math.sqrt(3) / 2, Format(0, 0, 17))
K_SQRT3_2 = SQRT3_2.value
DROP_BETA = SQRT3_2.fmt.frac_bits


@kernel
def step(u_dc):
    m, n, low = reciprocal.step(u_dc, N_MAX)
    m_beta = round_half_up(m * K_SQRT3_2, DROP_BETA)
    return m, m_beta, n, low


def reference(v, _state):
    u_dc = max(v["u_dc"], U_DC_MIN * U_DC.lsb)
    n = max(0, -math.floor(math.log2(u_dc)))
    m = 1.0 / (u_dc * 2.0**n)
    return {"m": m, "m_beta": m * math.sqrt(3) / 2, "n": n}


def bound(_v, _state):
    m = RECIPROCAL.lsb
    return {"m": m, "m_beta": m * math.sqrt(3) / 2 + RECIPROCAL.lsb / 2 + SQRT3_2.fmt.lsb / 2, "n": 0}


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
        Port("m", RECIPROCAL, doc="mantissa of 1/u_dc"),
        Port("m_beta", RECIPROCAL, doc="m * sqrt(3)/2"),
        Port("n", Format(0, 3, 0), doc="exponent of 1/u_dc"),
        Port("u_dc_low", BIT, doc="bus below 1/32 per unit"),
    ),
    latency=reciprocal.BLOCK.latency + 2,
    interval=reciprocal.BLOCK.interval + 2,
    constants={"N_MAX": N_MAX, "U_DC_MIN": U_DC_MIN, "SQRT3_2": SQRT3_2, "DROP_BETA": DROP_BETA},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
