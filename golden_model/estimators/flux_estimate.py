# SPDX-License-Identifier: BSD-3-Clause
"""The estimated flux linkages, paper 001 eq. (17): one of the two models plus the compensation.

    lambda_d = merged_d + lambda_pi_d      if the voltage is known and flux_mode selects the merge (``merged`` = 1)
    lambda_d = model_d + lambda_pi_d       otherwise; likewise for q

Both models come from flux_models, for the current of this sample: the decoupling uses the flux of this sample, not of
the previous one.  The compensation is that of the last sample.
flux_mode: 0 current model alone (6), 1 merged models (11), 2 earlier scheme (16), 3 proposed scheme (17).

Formats: the models floor to FLUX, which does not change the rounding of the sum half up to PU.
Saturation: at 2 per unit of flux, twice the flux of full voltage at base speed; reported by ``estimate_limited``,
which also reports a saturated merged flux.
"""

from golden_model.block import Block, Port
from golden_model.estimators.flux_models import CHOSEN, DROP_MERGED, DROP_MODEL, MODEL
from golden_model.fixed import exceeds, round_half_up, saturate
from golden_model.formats import BIT, FLUX, PU, PU_TO_FLUX, PU_W
from golden_model.kernel import kernel


@kernel
def axis(model, merged_flux, merged, lambda_pi):
    """One axis: (flux linkage, 1 if it was limited)."""
    chosen = merged_flux >> DROP_MERGED if merged else model >> DROP_MODEL
    rounded = round_half_up(lambda_pi + chosen, PU_TO_FLUX)
    return saturate(rounded, PU_W), exceeds(rounded, PU_W)


@kernel
def step(model_d, model_q, merged_d, merged_q, merged, ended, lambda_pi_d, lambda_pi_q):
    lambda_d, limited_d = axis(model_d, merged_d, merged, lambda_pi_d)
    lambda_q, limited_q = axis(model_q, merged_q, merged, lambda_pi_q)
    return lambda_d, lambda_q, limited_d | limited_q | ended


def reference(v, _state):
    out = {}
    for x in ("d", "q"):
        chosen = v[f"merged_{x}"] if v["merged"] else v[f"model_{x}"]
        out[f"lambda_{x}"] = PU.limit(chosen + v[f"lambda_pi_{x}"])
    return out


def bound(_v, _state):
    return dict.fromkeys(("lambda_d", "lambda_q"), PU.lsb / 2 + FLUX.lsb)


BLOCK = Block(
    name="flux_estimate",
    folder="estimators",
    paper="001, eq. (17)",
    step=step,
    inputs=(
        *MODEL,
        *CHOSEN,
        Port("lambda_pi_d", FLUX, doc="compensation, d axis"),
        Port("lambda_pi_q", FLUX, doc="compensation, q axis"),
    ),
    outputs=(
        Port("lambda_d", PU, doc="flux linkage, d axis"),
        Port("lambda_q", PU, doc="flux linkage, q axis"),
        Port("estimate_limited", BIT, doc="the estimate reached its range"),
    ),
    latency=1,
    reference=reference,
    bound=bound,
)
