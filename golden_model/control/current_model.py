"""Flux linkages from currents by the linear magnetic model, paper 001 eq. (6).

    lambda_d = l_d*i_d + lambda_mg
    lambda_q = l_q*i_q

Formats: products exact, 36 fraction bits; sum rounded half up to PU.
Saturation: at 2 per unit of flux, twice what full voltage makes at base speed.
"""

from golden_model.block import Block, Port
from golden_model.fixed import round_sat
from golden_model.formats import INDUCTANCE, PU, PU_W
from golden_model.kernel import kernel

DROP = INDUCTANCE.frac_bits


@kernel
def step(i_d, i_q, l_d, l_q, lambda_mg):
    sum_d = l_d * i_d + (lambda_mg << DROP)
    sum_q = l_q * i_q
    return round_sat(sum_d, DROP, PU_W), round_sat(sum_q, DROP, PU_W)


def reference(v, _state):
    lambda_d, lambda_q = v["l_d"] * v["i_d"] + v["lambda_mg"], v["l_q"] * v["i_q"]
    return {k: PU.limit(x) for k, x in (("lambda_d", lambda_d), ("lambda_q", lambda_q))}


def bound(_v, _state):
    return {"lambda_d": PU.lsb / 2, "lambda_q": PU.lsb / 2}


BLOCK = Block(
    name="current_model",
    folder="control",
    paper="001, eq. (6)",
    step=step,
    inputs=(Port("i_d", PU, doc="current, d axis"), Port("i_q", PU, doc="current, q axis")),
    registers=(
        Port("l_d", INDUCTANCE, doc="inductance, d axis"),
        Port("l_q", INDUCTANCE, doc="inductance, q axis"),
        Port("lambda_mg", PU, doc="magnet flux linkage"),
    ),
    outputs=(
        Port("lambda_d", PU, doc="flux linkage, d axis"),
        Port("lambda_q", PU, doc="flux linkage, q axis"),
    ),
    latency=3,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
)
