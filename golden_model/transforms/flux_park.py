# SPDX-License-Identifier: BSD-3-Clause
"""Merged flux linkage to the rotor frame: the rotation by -theta_me, in FLUX.

    lambda_m_d =  lambda_m_alpha*cos_theta + lambda_m_beta*sin_theta
    lambda_m_q = -lambda_m_alpha*sin_theta + lambda_m_beta*cos_theta

Formats, rounding and saturation: those of flux_rotate.
"""

from golden_model.block import Block, Port
from golden_model.formats import FLUX
from golden_model.kernel import kernel
from golden_model.transforms import flux_rotate, rotate


@kernel
def step(lambda_m_alpha, lambda_m_beta, cos_theta, sin_theta):
    lambda_m_q, lambda_m_d = flux_rotate.step(lambda_m_beta, lambda_m_alpha, cos_theta, sin_theta)
    return lambda_m_d, lambda_m_q


def reference(v, _state):
    c, s, alpha, beta = v["cos_theta"], v["sin_theta"], v["lambda_m_alpha"], v["lambda_m_beta"]
    return {"lambda_m_d": FLUX.limit(alpha * c + beta * s), "lambda_m_q": FLUX.limit(beta * c - alpha * s)}


def bound(_v, _state):
    return {"lambda_m_d": FLUX.lsb / 2, "lambda_m_q": FLUX.lsb / 2}


LAMBDA_M = (
    Port("lambda_m_alpha", FLUX, doc="merged flux before the sample's resistive drop, alpha"),
    Port("lambda_m_beta", FLUX, doc="merged flux before the sample's resistive drop, beta"),
)

LAMBDA_M_DQ = (
    Port("lambda_m_d", FLUX, doc="merged flux before the sample's resistive drop, d axis"),
    Port("lambda_m_q", FLUX, doc="merged flux before the sample's resistive drop, q axis"),
)

BLOCK = Block(
    name="flux_park",
    folder="transforms",
    paper="001, eq. (9): T_alphabeta/dq",
    step=step,
    inputs=(*LAMBDA_M, *rotate.TRIG_PORTS),
    outputs=LAMBDA_M_DQ,
    latency=flux_rotate.BLOCK.latency,
    interval=flux_rotate.BLOCK.interval,
    reference=reference,
    bound=bound,
    stimuli=flux_rotate.unit_vectors("lambda_m_alpha", "lambda_m_beta"),
)
