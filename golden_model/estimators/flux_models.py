# SPDX-License-Identifier: BSD-3-Clause
"""The flux linkages of this sample by both models, for flux_estimate and current_model.

    model_d  = l_d*i_d + lambda_mg      the linear magnetic model, paper 001 eq. (6)
    model_q  = l_q*i_q
    merged_d = lambda_m_d - rho*i_d     the merged models, eq. (11), at this sample; likewise for q

lambda_m is the flux that flux_merge integrated from the last sample, without this sample's resistive drop.  Both models
are affine in the measured current: one multiplication after the Park transform.
``merged`` selects: the merged flux if the voltage is known and flux_mode selects a merge, otherwise the current model.
``ended``: the selected merged flux is at the end of its range, because the rotation before has saturated.

Formats: model S(6,36) and merged S(2,40), both exact.
"""

from dataclasses import replace

from golden_model.block import Block, Port
from golden_model.estimators.winding_resistance import MINUS_RHO
from golden_model.fixed import Format
from golden_model.formats import BIT, FLUX, INDUCTANCE, PU, RESISTANCE
from golden_model.kernel import kernel
from golden_model.transforms.flux_park import LAMBDA_M_DQ

MODE = Format(0, 2, 0)
CURRENT_MODEL, MERGED, EARLIER, PROPOSED = 0, 1, 2, 3
MODEL_FLUX = Format(1, 6, PU.frac_bits + INDUCTANCE.frac_bits)
MERGED_FLUX = Format(1, 2, PU.frac_bits + RESISTANCE.frac_bits)
SHIFT_MG = MODEL_FLUX.frac_bits - PU.frac_bits
DROP_MODEL = MODEL_FLUX.frac_bits - FLUX.frac_bits
DROP_MERGED = MERGED_FLUX.frac_bits - FLUX.frac_bits
END_HI, END_LO = FLUX.hi, FLUX.lo
MODEL_MAX = 34 << MODEL_FLUX.frac_bits  # 16 of inductance times 2 of current, plus the magnet flux
MERGED_MAX = 5 << (MERGED_FLUX.frac_bits - 1)  # 2 of flux plus 1/4 of resistive drop times 2 of current


@kernel
def step(
    i_d, i_q, lambda_m_d, lambda_m_q, merge_known, run, minus_rho, flux_mode, l_d, l_q, lambda_mg
):  # fmt: skip
    model_d = (lambda_mg << SHIFT_MG) + l_d * i_d
    model_q = l_q * i_q
    merged_d = (lambda_m_d << DROP_MERGED) + minus_rho * i_d
    merged_q = (lambda_m_q << DROP_MERGED) + minus_rho * i_q
    merged = 1 if merge_known and run and flux_mode != CURRENT_MODEL else 0
    end_d = lambda_m_d == END_HI or lambda_m_d == END_LO
    end_q = lambda_m_q == END_HI or lambda_m_q == END_LO
    ended = 1 if merged and (end_d or end_q) else 0
    return model_d, model_q, merged_d, merged_q, merged, ended


def reference(v, _state):
    out = {}
    for x, magnet in (("d", v["lambda_mg"]), ("q", 0.0)):
        out[f"model_{x}"] = v[f"l_{x}"] * v[f"i_{x}"] + magnet
        out[f"merged_{x}"] = v[f"lambda_m_{x}"] + v["minus_rho"] * v[f"i_{x}"]
    return out


def bound(_v, _state):
    return dict.fromkeys(("model_d", "model_q", "merged_d", "merged_q"), 0.0)


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
    Port("model_d", MODEL_FLUX, -MODEL_MAX, MODEL_MAX, "flux linkage of the current model, d axis"),
    Port("model_q", MODEL_FLUX, -MODEL_MAX, MODEL_MAX, "flux linkage of the current model, q axis"),
)
CHOSEN = (
    Port("merged_d", MERGED_FLUX, -MERGED_MAX, MERGED_MAX, "merged flux at this sample, d axis"),
    Port("merged_q", MERGED_FLUX, -MERGED_MAX, MERGED_MAX, "merged flux at this sample, q axis"),
    Port("merged", BIT, doc="1: the merged flux is used, 0: the current model"),
    Port("ended", BIT, doc="1: the merged flux is used and saturated"),
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
        Port("merge_known", BIT, doc="1: the merged flux is valid"),
        Port("run", BIT, doc="1: the gates are switching"),
        MINUS_RHO,
    ),
    registers=(FLUX_MODE, L_D, L_Q, LAMBDA_MG),
    outputs=(*MODEL, *CHOSEN),
    latency=4,
    interval=4,
    constants={
        "MODEL_FLUX_W": MODEL_FLUX.width,
        "MERGED_FLUX_W": MERGED_FLUX.width,
        "SHIFT_MG": SHIFT_MG,
        "DROP_MODEL": DROP_MODEL,
        "DROP_MERGED": DROP_MERGED,
        "CURRENT_MODEL": CURRENT_MODEL,
        "EARLIER": EARLIER,
        "PROPOSED": PROPOSED,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
