# SPDX-License-Identifier: BSD-3-Clause
"""Estimated torque, paper 001 eq. (4): torque = 3/2*p*(lambda_d*i_q - lambda_q*i_d).

    torque = lambda_d*i_q - lambda_q*i_d        per unit of 3/2*p*lambda_base*I_base

Formats: products exact, 32 fraction bits; difference rounded half up to PU.
Saturation: at 2 per unit; flux and current both at their bases give 1.
"""

from golden_model.block import Block, Port
from golden_model.fixed import round_sat
from golden_model.formats import PU, PU_W
from golden_model.kernel import kernel

DROP = PU.frac_bits


@kernel
def step(lambda_d, lambda_q, i_d, i_q):
    prod_d = lambda_d * i_q
    prod_q = lambda_q * i_d
    diff = prod_d - prod_q
    return (round_sat(diff, DROP, PU_W),)


def reference(v, _state):
    return {"torque": PU.limit(v["lambda_d"] * v["i_q"] - v["lambda_q"] * v["i_d"])}


def bound(_v, _state):
    return {"torque": PU.lsb / 2}


BLOCK = Block(
    name="torque",
    folder="estimators",
    paper="001, eq. (4)",
    step=step,
    inputs=(
        Port("lambda_d", PU, doc="flux linkage, d axis"),
        Port("lambda_q", PU, doc="flux linkage, q axis"),
        Port("i_d", PU, doc="current, d axis"),
        Port("i_q", PU, doc="current, q axis"),
    ),
    outputs=(Port("torque", PU, doc="estimated torque"),),
    latency=5,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
)
