# SPDX-License-Identifier: BSD-3-Clause
"""The current model's flux linkage to the stator frame: the rotation by theta_me, in FLUX.

    lambda_c_alpha = lambda_c_d*cos_theta - lambda_c_q*sin_theta
    lambda_c_beta  = lambda_c_d*sin_theta + lambda_c_q*cos_theta

Formats, rounding and saturation: those of flux_rotate.
"""

from golden_model.block import Block, Port
from golden_model.formats import FLUX
from golden_model.kernel import kernel
from golden_model.transforms import flux_rotate, rotate


@kernel
def step(lambda_c_d, lambda_c_q, cos_theta, sin_theta):
    return flux_rotate.step(lambda_c_d, lambda_c_q, cos_theta, sin_theta)


def reference(v, _state):
    c, s, d, q = v["cos_theta"], v["sin_theta"], v["lambda_c_d"], v["lambda_c_q"]
    return {"lambda_c_alpha": FLUX.limit(d * c - q * s), "lambda_c_beta": FLUX.limit(d * s + q * c)}


def bound(_v, _state):
    return {"lambda_c_alpha": FLUX.lsb / 2, "lambda_c_beta": FLUX.lsb / 2}


BLOCK = Block(
    name="flux_inverse_park",
    folder="transforms",
    paper="001, eq. (9): T_dq/alphabeta",
    step=step,
    inputs=(
        Port("lambda_c_d", FLUX, doc="flux linkage of the current model, d axis"),
        Port("lambda_c_q", FLUX, doc="flux linkage of the current model, q axis"),
        *rotate.TRIG_PORTS,
    ),
    outputs=(
        Port("lambda_c_alpha", FLUX, doc="flux linkage of the current model, alpha"),
        Port("lambda_c_beta", FLUX, doc="flux linkage of the current model, beta"),
    ),
    latency=flux_rotate.BLOCK.latency,
    interval=flux_rotate.BLOCK.interval,
    reference=reference,
    bound=bound,
    stimuli=flux_rotate.unit_vectors("lambda_c_d", "lambda_c_q"),
)
