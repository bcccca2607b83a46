# SPDX-License-Identifier: BSD-3-Clause
"""Flux linkages from currents by the linear magnetic model, paper 001 eq. (6), with the correction of eq. (16).

    lambda_c_d = l_d*i_d + lambda_mg + lambda_add_d = model_d + lambda_add_d
    lambda_c_q = l_q*i_q             + lambda_add_q = model_q + lambda_add_q

``model`` comes from flux_models.
``lambda_add`` is the correction of the earlier scheme, eq. (16), which adds delta_lambda to this model; zero in every
other mode (see flux_compensation).
Formats: model S(6,36), rounded half up to FLUX; the sum exact.
Saturation: at 2 per unit of flux, twice the flux of full voltage at base speed; reported by ``model_limited``.
"""

from golden_model.block import Block, Port
from golden_model.estimators.flux_models import DROP_MODEL, MODEL
from golden_model.fixed import exceeds, round_half_up, saturate
from golden_model.formats import BIT, FLUX, FLUX_W
from golden_model.kernel import kernel


@kernel
def step(model_d, model_q, lambda_add_d, lambda_add_q):
    rounded_d = lambda_add_d + round_half_up(model_d, DROP_MODEL)
    rounded_q = lambda_add_q + round_half_up(model_q, DROP_MODEL)
    limited = exceeds(rounded_d, FLUX_W) | exceeds(rounded_q, FLUX_W)
    return saturate(rounded_d, FLUX_W), saturate(rounded_q, FLUX_W), limited


def reference(v, _state):
    sums = {x: v[f"model_{x}"] + v[f"lambda_add_{x}"] for x in ("d", "q")}
    return {f"lambda_c_{x}": FLUX.limit(total) for x, total in sums.items()}


def bound(_v, _state):
    return {"lambda_c_d": FLUX.lsb / 2, "lambda_c_q": FLUX.lsb / 2}


BLOCK = Block(
    name="current_model",
    folder="estimators",
    paper="001, eq. (6); with lambda_add the last term of eq. (16)",
    step=step,
    inputs=(
        *MODEL,
        Port("lambda_add_d", FLUX, doc="correction of eq. (16), d axis"),
        Port("lambda_add_q", FLUX, doc="correction of eq. (16), q axis"),
    ),
    outputs=(
        Port("lambda_c_d", FLUX, doc="flux linkage of the current model, d axis"),
        Port("lambda_c_q", FLUX, doc="flux linkage of the current model, q axis"),
        Port("model_limited", BIT, doc="the current model reached its range"),
    ),
    latency=2,
    reference=reference,
    bound=bound,
)
