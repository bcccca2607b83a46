# SPDX-License-Identifier: BSD-3-Clause
"""The voltage at the motor's terminals: the commanded voltage minus the voltage loss of the inverter's legs.

    u_clean_alpha = u_applied_alpha - v_leg*s_alpha(k-1)
    u_clean_beta  = u_applied_beta  - v_leg*s_beta(k-1)

s_alpha, s_beta are the directions of the phase currents as they will be when this sample's voltage acts; the voltage of
the coming period is that of the previous sample, and so are its directions.  v_leg is the whole estimated loss by dead
time and drops, compensated or not.  The flux estimator of paper 001 uses the result as u.

Formats: product 34 fraction bits, rounded half up to FLUX; the difference saturates at 2 per unit, just above the
largest sum of voltage, 1.34, and leg voltage, 0.5*4/3.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_subtract
from golden_model.control.dead_time_compensation import S_ALPHA, S_BETA
from golden_model.formats import FLUX, FLUX_W, PU, V_LEG
from golden_model.kernel import kernel

DROP = PU.frac_bits + V_LEG.frac_bits - FLUX.frac_bits


class State(NamedTuple):
    s_alpha: int = 0  # PU
    s_beta: int = 0


@kernel
def step(state, u_applied_alpha, u_applied_beta, s_alpha, s_beta, v_leg):
    u_clean_alpha, _ = multiply_subtract(v_leg, state.s_alpha, u_applied_alpha, DROP, FLUX_W)
    u_clean_beta, _ = multiply_subtract(v_leg, state.s_beta, u_applied_beta, DROP, FLUX_W)
    return State(s_alpha, s_beta), (u_clean_alpha, u_clean_beta)


def reference(v, state):
    s = {"alpha": state.s_alpha * PU.lsb, "beta": state.s_beta * PU.lsb}
    return {f"u_clean_{x}": FLUX.limit(v[f"u_applied_{x}"] - v["v_leg"] * s[x]) for x in s}


def bound(_v, _state):
    return dict.fromkeys(("u_clean_alpha", "u_clean_beta"), FLUX.lsb / 2)


BLOCK = Block(
    name="clean_voltage",
    folder="estimators",
    paper="000, eq. (4); 001, eq. (5): the voltage without the inverter's distortion",
    step=step,
    inputs=(
        Port("u_applied_alpha", FLUX, doc="voltage of the coming period, alpha"),
        Port("u_applied_beta", FLUX, doc="voltage of the coming period, beta"),
        S_ALPHA,
        S_BETA,
        Port("v_leg", V_LEG, doc="leg voltage loss by dead time and device drops"),
    ),
    outputs=(
        Port("u_clean_alpha", FLUX, doc="voltage at the motor in the coming period, alpha"),
        Port("u_clean_beta", FLUX, doc="voltage at the motor in the coming period, beta"),
    ),
    state=State(),
    latency=5,
    interval=5,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
)
