# SPDX-License-Identifier: BSD-3-Clause
"""The compensation voltage for dead time and device drops, in the stator frame: paper 000, section V.B.

    u_comp_alpha = v_comp*s_alpha
    u_comp_beta  = v_comp*s_beta

s_alpha, s_beta: Clarke transform of the directions that the phase currents will have when this sample's voltage
acts, predicted in the previous sample.  Rotated into the rotor frame by the angle of that instant they are a third
of the paper's D_d, D_q of eq. (5), and this voltage is its D*gamma*V_dead.

Formats: products exact, 34 fraction bits, rounded half up to PU.  |s| <= 4/3 and v_comp < 1/2: no saturation.
"""

from golden_model.block import Block, Port
from golden_model.fixed import round_half_up
from golden_model.formats import PU, V_LEG
from golden_model.kernel import kernel

DROP = V_LEG.frac_bits


@kernel
def step(v_comp, s_alpha, s_beta):
    u_comp_alpha = round_half_up(v_comp * s_alpha, DROP)
    u_comp_beta = round_half_up(v_comp * s_beta, DROP)
    return u_comp_alpha, u_comp_beta


def reference(v, _state):
    return {f"u_comp_{x}": v["v_comp"] * v[f"s_{x}"] for x in ("alpha", "beta")}


def bound(_v, _state):
    return {"u_comp_alpha": PU.lsb / 2, "u_comp_beta": PU.lsb / 2}


S_ALPHA = Port("s_alpha", PU, lo=-87400, hi=87400, doc="directions of the currents, alpha")
S_BETA = Port("s_beta", PU, lo=-87400, hi=87400, doc="directions of the currents, beta")
D_D = Port("d_d", PU, lo=-87400, hi=87400, doc="direction function D_d / 3")
D_Q = Port("d_q", PU, lo=-87400, hi=87400, doc="direction function D_q / 3")

BLOCK = Block(
    name="dead_time_compensation",
    folder="control",
    paper="000, section V.B, step d",
    step=step,
    inputs=(Port("v_comp", V_LEG, doc="leg voltage that is compensated"), S_ALPHA, S_BETA),
    outputs=(
        Port("u_comp_alpha", PU, doc="compensation voltage, alpha"),
        Port("u_comp_beta", PU, doc="compensation voltage, beta"),
    ),
    latency=5,
    interval=4,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
)
