"""Flux linkages from currents by the linear magnetic model, paper 001 eq. (6).

    lambda_c_d = l_d*i_d + lambda_mg + lambda_add_d
    lambda_c_q = l_q*i_q             + lambda_add_q

``lambda_add`` is the earlier scheme's correction, eq. (16), which adds delta_lambda to this model; zero in
every other mode (see flux_compensation).
Formats: products exact, 36 fraction bits; sum rounded half up to FLUX.
Saturation: at 2 per unit of flux, twice what full voltage makes at base speed; told by ``model_limited``.
"""

from golden_model.block import Block, Port
from golden_model.fixed import exceeds, round_half_up, saturate
from golden_model.formats import BIT, FLUX, FLUX_W, INDUCTANCE, PU
from golden_model.kernel import kernel

SHIFT_MG = INDUCTANCE.frac_bits
SHIFT_ADD = PU.frac_bits + INDUCTANCE.frac_bits - FLUX.frac_bits
DROP = SHIFT_ADD


@kernel
def step(i_d, i_q, lambda_add_d, lambda_add_q, l_d, l_q, lambda_mg):
    sum_d = l_d * i_d + (lambda_mg << SHIFT_MG) + (lambda_add_d << SHIFT_ADD)
    sum_q = l_q * i_q + (lambda_add_q << SHIFT_ADD)
    rounded_d, rounded_q = round_half_up(sum_d, DROP), round_half_up(sum_q, DROP)
    limited = exceeds(rounded_d, FLUX_W) | exceeds(rounded_q, FLUX_W)
    return saturate(rounded_d, FLUX_W), saturate(rounded_q, FLUX_W), limited


def reference(v, _state):
    lambda_d = v["l_d"] * v["i_d"] + v["lambda_mg"] + v["lambda_add_d"]
    lambda_q = v["l_q"] * v["i_q"] + v["lambda_add_q"]
    return {"lambda_c_d": FLUX.limit(lambda_d), "lambda_c_q": FLUX.limit(lambda_q)}


def bound(_v, _state):
    return {"lambda_c_d": FLUX.lsb / 2, "lambda_c_q": FLUX.lsb / 2}


L_D = Port("l_d", INDUCTANCE, doc="inductance, d axis")
L_Q = Port("l_q", INDUCTANCE, doc="inductance, q axis")
LAMBDA_MG = Port("lambda_mg", PU, doc="magnet flux linkage")

BLOCK = Block(
    name="current_model",
    folder="estimators",
    paper="001, eq. (6); with lambda_add the last term of eq. (16)",
    step=step,
    inputs=(
        Port("i_d", PU, doc="current, d axis"),
        Port("i_q", PU, doc="current, q axis"),
        Port("lambda_add_d", FLUX, doc="correction of eq. (16), d axis"),
        Port("lambda_add_q", FLUX, doc="correction of eq. (16), q axis"),
    ),
    registers=(L_D, L_Q, LAMBDA_MG),
    outputs=(
        Port("lambda_c_d", FLUX, doc="flux linkage of the current model, d axis"),
        Port("lambda_c_q", FLUX, doc="flux linkage of the current model, q axis"),
        Port("model_limited", BIT, doc="the current model reached its range"),
    ),
    latency=3,
    constants={"SHIFT_MG": SHIFT_MG, "SHIFT_ADD": SHIFT_ADD, "DROP": DROP},
    reference=reference,
    bound=bound,
)
