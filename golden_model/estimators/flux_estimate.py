"""The estimated flux linkages, paper 001 eq. (17): merged models plus the compensation.

    lambda_d = merged_d      if the voltage is known and flux_mode selects the merge (``merged`` = 1)
    lambda_d = model_d       otherwise; likewise for q

Both models come from flux_models, for the current of this sample and with the compensation included: the decoupling
uses the flux of this sample, not of the previous one.
flux_mode: 0 current model alone (6), 1 merged models (11), 2 earlier scheme (16), 3 proposed scheme (17).

Formats: the compensation includes half an LSB of PU, so that truncation rounds the flux half up.
Saturation: at 2 per unit of flux, twice the flux of full voltage at base speed; reported by ``estimate_limited``,
which also reports a saturated merged flux.
"""

from fluxproof.golden_model.block import Block, Port
from fluxproof.golden_model.estimators.flux_models import CHOSEN, MODEL
from fluxproof.golden_model.fixed import exceeds, saturate
from fluxproof.golden_model.formats import BIT, PU, PU_TO_FLUX, PU_W
from fluxproof.golden_model.kernel import kernel


@kernel
def axis(model, merged_flux, merged):
    """One axis: (flux linkage, 1 if it was limited)."""
    cut = merged_flux >> PU_TO_FLUX if merged else model >> (PU_TO_FLUX + 1)
    return saturate(cut, PU_W), exceeds(cut, PU_W)


@kernel
def step(model_d, model_q, merged_d, merged_q, merged, ended):
    lambda_d, limited_d = axis(model_d, merged_d, merged)
    lambda_q, limited_q = axis(model_q, merged_q, merged)
    return lambda_d, lambda_q, limited_d | limited_q | ended


def reference(v, _state):
    out = {}
    for x in ("d", "q"):
        chosen = v[f"merged_{x}"] if v["merged"] else v[f"model_{x}"]
        out[f"lambda_{x}"] = PU.limit(chosen - PU.lsb / 2)
    return out


def bound(_v, _state):
    return dict.fromkeys(("lambda_d", "lambda_q"), PU.lsb / 2)


BLOCK = Block(
    name="flux_estimate",
    folder="estimators",
    paper="001, eq. (17)",
    step=step,
    inputs=(*MODEL, *CHOSEN),
    outputs=(
        Port("lambda_d", PU, doc="flux linkage, d axis"),
        Port("lambda_q", PU, doc="flux linkage, q axis"),
        Port("estimate_limited", BIT, doc="the estimate reached its range"),
    ),
    latency=1,
    reference=reference,
    bound=bound,
)
