"""The estimated flux linkages, paper 001 eq. (17): merged models plus the compensation.

    lambda_d = merged_d      where the voltage is known and a merge is wanted (``merged``)
    lambda_d = model_d       else; q alike

Both models are those of flux_models, for the current that has just been measured, with the compensation in them: the
decoupling gets this sample's flux, not the last one's.
flux_mode: 0 current model alone (6), 1 merged models (11), 2 earlier scheme (16), 3 proposed scheme (17).

Formats: half an LSB of PU comes with the compensation, so that the flux is rounded half up by a cut.
Saturation: at 2 per unit of flux, twice what full voltage makes at base speed; told by ``estimate_limited``,
which also tells of a merged flux at its end.
"""

from fluxproof.golden_model.block import Block, Port
from fluxproof.golden_model.estimators.flux_models import CHOSEN, MODEL
from fluxproof.golden_model.fixed import exceeds, saturate
from fluxproof.golden_model.formats import BIT, PU, PU_TO_FLUX, PU_W
from fluxproof.golden_model.kernel import kernel


@kernel
def axis(model, merged_flux, merged):
    """One axis: (flux linkage, 1 where it was limited)."""
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
