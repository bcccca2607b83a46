"""The estimated flux linkages, paper 001 eq. (17): merged models plus the compensation.

    lambda_d = lambda_m_d - rho*i_d + lambda_pi_d        where the voltage is known and a merge is wanted
    lambda_d = lambda_mg + l_d*i_d  + lambda_pi_d        else: the current model (6); q alike, without lambda_mg

lambda_m is the flux that flux_merge carried here from the last sample, all but this sample's resistive drop.
Either way the estimate is affine in the current that has just been measured, so one multiplication follows
the Park transform and the decoupling gets this sample's flux, not the last one's.
flux_mode: 0 current model alone (6), 1 merged models (11), 2 earlier scheme (16), 3 proposed scheme (17).

Formats: products and sum exact, 40 fraction bits, rounded half up to PU.
Saturation: at 2 per unit of flux, twice what full voltage makes at base speed; told by ``estimate_limited``,
which also tells of a merged flux at its end, where the rotation before has saturated.
"""

from golden_model.block import Block, Port
from golden_model.estimators import current_model
from golden_model.estimators.winding_resistance import RHO
from golden_model.fixed import Format, exceeds, round_half_up, saturate
from golden_model.formats import BIT, FLUX, INDUCTANCE, PU, PU_TO_FLUX, PU_W, RESISTANCE
from golden_model.kernel import kernel

MODE = Format(0, 2, 0)
CURRENT_MODEL, MERGED, EARLIER, PROPOSED = 0, 1, 2, 3
SHIFT_BASE = PU.frac_bits + RESISTANCE.frac_bits - FLUX.frac_bits
SHIFT_MODEL = RESISTANCE.frac_bits - INDUCTANCE.frac_bits
DROP = RESISTANCE.frac_bits
END_HI, END_LO = FLUX.hi, FLUX.lo


@kernel
def axis(i, lambda_m, lambda_pi, merged, rho, inductance, magnet):
    """One axis: (flux linkage, 1 where it was limited)."""
    prod = -rho * i if merged else (inductance * i) << SHIFT_MODEL
    base = (lambda_m if merged else magnet << PU_TO_FLUX) + lambda_pi
    rounded = round_half_up((base << SHIFT_BASE) + prod, DROP)
    ended = merged and (lambda_m == END_HI or lambda_m == END_LO)
    limited = 1 if ended else exceeds(rounded, PU_W)
    return saturate(rounded, PU_W), limited


@kernel
def step(
    i_d,
    i_q,
    lambda_m_d,
    lambda_m_q,
    lambda_pi_d,
    lambda_pi_q,
    merge_known,
    run,
    rho,
    flux_mode,
    l_d,
    l_q,
    lambda_mg,
):
    merged = merge_known and run and flux_mode != CURRENT_MODEL
    lambda_d, limited_d = axis(i_d, lambda_m_d, lambda_pi_d, merged, rho, l_d, lambda_mg)
    lambda_q, limited_q = axis(i_q, lambda_m_q, lambda_pi_q, merged, rho, l_q, 0)
    return lambda_d, lambda_q, limited_d | limited_q


def reference(v, _state):
    out = {}
    for x, magnet in (("d", v["lambda_mg"]), ("q", 0.0)):
        if v["merge_known"] and v["run"] and v["flux_mode"] != CURRENT_MODEL:
            model = v[f"lambda_m_{x}"] - v["rho"] * v[f"i_{x}"]
        else:
            model = magnet + v[f"l_{x}"] * v[f"i_{x}"]
        out[f"lambda_{x}"] = PU.limit(model + v[f"lambda_pi_{x}"])
    return out


def bound(_v, _state):
    return {"lambda_d": PU.lsb / 2, "lambda_q": PU.lsb / 2}


def stimuli(rng, _config):
    """Every mode with the voltage known and not; a merged flux at its ends and next to them."""
    rows = []
    for mode in range(4):
        for known, run in ((1, 1), (0, 1), (1, 0)):
            for m in (END_HI, END_HI - 1, END_LO, END_LO + 1, 0):
                small = {
                    k: int(rng.integers(-999, 999)) for k in ("i_d", "i_q", "lambda_pi_d", "lambda_pi_q")
                }
                flags = {"flux_mode": mode, "merge_known": known, "run": run}
                rows.append({**small, **flags, "lambda_m_d": m, "lambda_m_q": -1 - m, "l_d": 1 << 20})
    return rows


FLUX_MODE = Port("flux_mode", MODE, doc="0: eq. (6), 1: eq. (11), 2: eq. (16), 3: eq. (17)")

BLOCK = Block(
    name="flux_estimate",
    folder="estimators",
    paper="001, eq. (17)",
    step=step,
    inputs=(
        Port("i_d", PU, doc="current, d axis"),
        Port("i_q", PU, doc="current, q axis"),
        Port("lambda_m_d", FLUX, doc="merged flux before the sample's resistive drop, d axis"),
        Port("lambda_m_q", FLUX, doc="merged flux before the sample's resistive drop, q axis"),
        Port("lambda_pi_d", FLUX, doc="compensation, d axis"),
        Port("lambda_pi_q", FLUX, doc="compensation, q axis"),
        Port("merge_known", BIT, doc="the merged flux is good"),
        Port("run", BIT, doc="1: the gates are switching"),
        RHO,
    ),
    registers=(FLUX_MODE, current_model.L_D, current_model.L_Q, current_model.LAMBDA_MG),
    outputs=(
        Port("lambda_d", PU, doc="flux linkage, d axis"),
        Port("lambda_q", PU, doc="flux linkage, q axis"),
        Port("estimate_limited", BIT, doc="the estimate reached its range"),
    ),
    latency=3,
    constants={
        "SHIFT_BASE": SHIFT_BASE,
        "SHIFT_MODEL": SHIFT_MODEL,
        "DROP": DROP,
        "CURRENT_MODEL": CURRENT_MODEL,
        "EARLIER": EARLIER,
        "PROPOSED": PROPOSED,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
