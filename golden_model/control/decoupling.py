# SPDX-License-Identifier: BSD-3-Clause
"""Rotational voltages, the last term of paper 001 eq. (2), added to the current regulators' outputs.

    u_dec_d = -omega_chord*lambda_q
    u_dec_q =  omega_chord*lambda_d

Formats: products exact, 32 fraction bits, rounded half up to PU.
Saturation: at 2 per unit, twice the largest voltage of the limiter.
"""

from golden_model.block import Block, Port
from golden_model.fixed import round_sat
from golden_model.formats import PU, PU_W
from golden_model.kernel import kernel

DROP = PU.frac_bits


@kernel
def step(omega_chord, lambda_d, lambda_q):
    prod_d = omega_chord * lambda_q
    prod_q = omega_chord * lambda_d
    return round_sat(-prod_d, DROP, PU_W), round_sat(prod_q, DROP, PU_W)


def reference(v, _state):
    u_d, u_q = -v["omega_chord"] * v["lambda_q"], v["omega_chord"] * v["lambda_d"]
    return {k: PU.limit(x) for k, x in (("u_dec_d", u_d), ("u_dec_q", u_q))}


def bound(_v, _state):
    return {"u_dec_d": PU.lsb / 2, "u_dec_q": PU.lsb / 2}


BLOCK = Block(
    name="decoupling",
    folder="control",
    paper="001, eq. (2), 'dq decoupling term' of Fig. 8",
    step=step,
    inputs=(
        Port("omega_chord", PU, doc="electrical speed along the chord of a sample"),
        Port("lambda_d", PU, doc="flux linkage, d axis"),
        Port("lambda_q", PU, doc="flux linkage, q axis"),
    ),
    outputs=(
        Port("u_dec_d", PU, doc="rotational voltage, d axis"),
        Port("u_dec_q", PU, doc="rotational voltage, q axis"),
    ),
    latency=2,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
)
