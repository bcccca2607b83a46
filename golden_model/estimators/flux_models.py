"""The flux linkages of this sample by both models, for flux_estimate and current_model.

    model_d  = l_d*i_d + lambda_mg + raised_d     the linear magnetic model, paper 001 eq. (6)
    model_q  = l_q*i_q + raised_q
    merged_d = lambda_m_d - rho*i_d + raised_d    the merged models, eq. (11), at this sample; likewise for q

lambda_m is the flux that flux_merge integrated from the last sample, without this sample's resistive drop.  Both models
are affine in the measured current: one multiplication after the Park transform.
``merged`` selects: the merged flux if the voltage is known and flux_mode selects a merge, otherwise the current model.
``ended``: the selected merged flux is at the end of its range, because the rotation before has saturated.

``raised``: the compensation plus half an LSB of PU, so that truncation in flux_estimate rounds half up.  It is known
from the last sample and added before the current is available.  current_model subtracts it again.

Formats: products and sums exact.  model is floored to half an LSB of FLUX, merged to FLUX: the floor does not change
the rounding half up to PU.
"""

from dataclasses import replace

from fluxproof.golden_model.block import Block, Port
from fluxproof.golden_model.estimators.winding_resistance import MINUS_RHO
from fluxproof.golden_model.fixed import Format
from fluxproof.golden_model.formats import BIT, FLUX, INDUCTANCE, PU, PU_TO_FLUX, RESISTANCE
from fluxproof.golden_model.kernel import kernel
from fluxproof.golden_model.transforms.flux_park import LAMBDA_M_DQ

MODE = Format(0, 2, 0)
CURRENT_MODEL, MERGED, EARLIER, PROPOSED = 0, 1, 2, 3
MODEL_FLUX = Format(1, 6, FLUX.frac_bits + 1)
MERGED_FLUX = Format(1, 3, FLUX.frac_bits)
RAISED = Format(1, 2, FLUX.frac_bits)
SHIFT_MG = INDUCTANCE.frac_bits
SHIFT_MODEL = PU.frac_bits + INDUCTANCE.frac_bits - FLUX.frac_bits
DROP_MODEL = PU.frac_bits + INDUCTANCE.frac_bits - MODEL_FLUX.frac_bits
DROP_MERGED = PU.frac_bits + RESISTANCE.frac_bits - MERGED_FLUX.frac_bits
HALF_PU = 1 << (PU_TO_FLUX - 1)
END_HI, END_LO = FLUX.hi, FLUX.lo
MODEL_MAX = 37 << MODEL_FLUX.frac_bits  # 16 of inductance times 2 of current, plus magnet flux and compensation


@kernel
def step(
    i_d, i_q, lambda_m_d, lambda_m_q, lambda_pi_d, lambda_pi_q, merge_known, run, minus_rho,
    flux_mode, l_d, l_q, lambda_mg,
):  # fmt: skip
    raised_d, raised_q = lambda_pi_d + HALF_PU, lambda_pi_q + HALF_PU
    model_d = (l_d * i_d + (lambda_mg << SHIFT_MG) + (raised_d << SHIFT_MODEL)) >> DROP_MODEL
    model_q = (l_q * i_q + (raised_q << SHIFT_MODEL)) >> DROP_MODEL
    merged_d = (((lambda_m_d + raised_d) << DROP_MERGED) + minus_rho * i_d) >> DROP_MERGED
    merged_q = (((lambda_m_q + raised_q) << DROP_MERGED) + minus_rho * i_q) >> DROP_MERGED
    merged = 1 if merge_known and run and flux_mode != CURRENT_MODEL else 0
    end_d = lambda_m_d == END_HI or lambda_m_d == END_LO
    end_q = lambda_m_q == END_HI or lambda_m_q == END_LO
    ended = 1 if merged and (end_d or end_q) else 0
    return model_d, model_q, merged_d, merged_q, merged, ended, raised_d, raised_q


def reference(v, _state):
    out = {}
    for x, magnet in (("d", v["lambda_mg"]), ("q", 0.0)):
        raised = v[f"lambda_pi_{x}"] + PU.lsb / 2
        out[f"model_{x}"] = v[f"l_{x}"] * v[f"i_{x}"] + magnet + raised
        out[f"merged_{x}"] = v[f"lambda_m_{x}"] + v["minus_rho"] * v[f"i_{x}"] + raised
        out[f"raised_{x}"] = raised
    return out


def bound(_v, _state):
    return {
        **dict.fromkeys(("model_d", "model_q"), MODEL_FLUX.lsb),
        **dict.fromkeys(("merged_d", "merged_q"), FLUX.lsb),
        **dict.fromkeys(("raised_d", "raised_q"), 0.0),
    }


def stimuli(rng, _config):
    """Every mode with the voltage known and not; a merged flux at its ends and next to them."""
    rows = []
    for mode in range(4):
        for known, run in ((1, 1), (0, 1), (1, 0)):
            for m in (END_HI, END_HI - 1, END_LO, END_LO + 1, 0):
                small = {k: int(rng.integers(-999, 999)) for k in ("i_d", "i_q")}
                flags = {"flux_mode": mode, "merge_known": known, "run": run}
                rows.append({**small, **flags, "lambda_m_d": m, "lambda_m_q": 7, "l_d": 1 << 20})
                rows.append({**small, **flags, "lambda_m_d": -7, "lambda_m_q": m, "l_q": 1 << 20})
    return rows


FLUX_MODE = Port("flux_mode", MODE, doc="0: eq. (6), 1: eq. (11), 2: eq. (16), 3: eq. (17)")
L_D = Port("l_d", INDUCTANCE, doc="inductance, d axis")
L_Q = Port("l_q", INDUCTANCE, doc="inductance, q axis")
LAMBDA_MG = Port("lambda_mg", PU, doc="magnet flux linkage")
MODEL = (
    Port("model_d", MODEL_FLUX, -MODEL_MAX, MODEL_MAX, "flux linkage of the current model plus raised, d axis"),
    Port("model_q", MODEL_FLUX, -MODEL_MAX, MODEL_MAX, "flux linkage of the current model plus raised, q axis"),
)
CHOSEN = (
    Port("merged_d", MERGED_FLUX, doc="merged flux at this sample plus raised, d axis"),
    Port("merged_q", MERGED_FLUX, doc="merged flux at this sample plus raised, q axis"),
    Port("merged", BIT, doc="1: the merged flux is used, 0: the current model"),
    Port("ended", BIT, doc="1: the merged flux is used and saturated"),
)
RAISED_DQ = (
    Port("raised_d", RAISED, FLUX.lo, FLUX.hi + HALF_PU, "compensation and half an LSB of PU, d axis"),
    Port("raised_q", RAISED, FLUX.lo, FLUX.hi + HALF_PU, "compensation and half an LSB of PU, q axis"),
)

BLOCK = Block(
    name="flux_models",
    folder="estimators",
    paper="001, eq. (6) and (11)",
    step=step,
    inputs=(
        Port("i_d", PU, doc="current, d axis"),
        Port("i_q", PU, late=1, doc="current, q axis"),
        *(replace(port, late=2) for port in LAMBDA_M_DQ),
        Port("lambda_pi_d", FLUX, doc="compensation, d axis"),
        Port("lambda_pi_q", FLUX, doc="compensation, q axis"),
        Port("merge_known", BIT, doc="1: the merged flux is valid"),
        Port("run", BIT, doc="1: the gates are switching"),
        MINUS_RHO,
    ),
    registers=(FLUX_MODE, L_D, L_Q, LAMBDA_MG),
    outputs=(*MODEL, *CHOSEN, *RAISED_DQ),
    latency=4,
    interval=3,
    constants={
        "MODEL_FLUX_W": MODEL_FLUX.width,
        "MERGED_FLUX_W": MERGED_FLUX.width,
        "RAISED_W": RAISED.width,
        "SHIFT_MODEL": SHIFT_MODEL,
        "DROP_MODEL": DROP_MODEL,
        "DROP_MERGED": DROP_MERGED,
        "HALF_PU": HALF_PU,
        "CURRENT_MODEL": CURRENT_MODEL,
        "EARLIER": EARLIER,
        "PROPOSED": PROPOSED,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
