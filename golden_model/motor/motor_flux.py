# SPDX-License-Identifier: BSD-3-Clause
"""Integrates the flux linkages of the windings in the stator frame: d lambda/dt = u - R*i, a step at once.

    s_x      = leg_x - r_x*i_x                       of phase x: voltage minus resistive drop, times clocks
    lambda_alpha += 2*s_a - s_b - s_c
    lambda_beta  += sqrt(3)*(s_b - s_c)              start: lambda = (psi_start, 0), the rotor's flux at the angle zero

The flux's base is a third of 2**16 clocks times the voltage's base, so the integration of a voltage takes no factor and
rounds nothing in alpha.  The zero sequence of the legs cancels.
Formats: leg S(6,22), r U(3,21) for the whole step, i PU; the drop is rounded half up to 22 fraction bits; s_b - s_c
is rounded half up to 17, sqrt(3) S(1,16), their product to the 38 of the state; the outputs are cut to FLUX.
Sums saturate.
"""

import math
from typing import NamedTuple

from golden_model.block import Block, Const, Port
from golden_model.common.multiply_add import multiply_subtract
from golden_model.fixed import Format, round_half_up, round_sat, saturate
from golden_model.formats import BIT, FLUX, MOTOR_FLUX, MOTOR_LEG, PU
from golden_model.kernel import kernel

CLOCKS_BITS = 16  # the flux's base is a third of 2**CLOCKS_BITS clocks times the voltage's
DROP_R = Format(0, 3, 21)  # R*i over a step: per unit of current, in voltage times clocks
SQRT3 = Const(math.sqrt(3.0), Format(1, 1, 16))
LEG_W, STATE_W = MOTOR_LEG.width, MOTOR_FLUX.width
DROP_RI = DROP_R.frac_bits + PU.frac_bits - MOTOR_LEG.frac_bits
DROP_D = 5
DROP_BETA = (MOTOR_LEG.frac_bits - DROP_D) + 16 + CLOCKS_BITS - MOTOR_FLUX.frac_bits
DROP_OUT = MOTOR_FLUX.frac_bits - FLUX.frac_bits
BY_SQRT3 = SQRT3.value
D_W = 25
HIDDEN = (1 << DROP_OUT) - 1  # of the state, below the output
# s_b - s_c, in LSB of what sqrt(3) multiplies, that move beta by HIDDEN: 6, -8 and 2 move it by one, by their rounding
BACK = (591, *(6, -8, 2) * 10)


class State(NamedTuple):
    alpha: int = 0
    beta: int = 0


@kernel
def step(state, leg_a, leg_b, leg_c, i_a, i_b, i_c, start, r_a, r_b, r_c, psi_start):
    s_a, _ = multiply_subtract(r_a, i_a, leg_a, DROP_RI, LEG_W)
    s_b, _ = multiply_subtract(r_b, i_b, leg_b, DROP_RI, LEG_W)
    s_c, _ = multiply_subtract(r_c, i_c, leg_c, DROP_RI, LEG_W)
    difference = round_sat(s_b - s_c, DROP_D, D_W)
    alpha = saturate(state.alpha + 2 * s_a - s_b - s_c, STATE_W)
    beta = saturate(state.beta + round_half_up(difference * BY_SQRT3, DROP_BETA), STATE_W)
    if start:
        alpha, beta = psi_start << DROP_OUT, 0
    return State(alpha, beta), (alpha >> DROP_OUT, beta >> DROP_OUT)


def reference(v, state):
    if v["start"]:
        return {"lambda_alpha": v["psi_start"], "lambda_beta": 0.0}
    top = 2.0 ** (LEG_W - 1) * MOTOR_LEG.lsb
    a, b, c = (min(max(v[f"leg_{x}"] - v[f"r_{x}"] * v[f"i_{x}"], -top), top) for x in "abc")
    alpha = state.alpha * MOTOR_FLUX.lsb + (2 * a - b - c) / 2.0**CLOCKS_BITS
    beta = state.beta * MOTOR_FLUX.lsb + math.sqrt(3.0) * (b - c) / 2.0**CLOCKS_BITS
    return {"lambda_alpha": FLUX.limit(alpha), "lambda_beta": FLUX.limit(beta)}


def bound(_v, _state):
    """Of a step: half an LSB of three drops, of the difference, of sqrt(3) at the largest difference, of the output."""
    drops, widest = 4 * MOTOR_LEG.lsb, 2.0 ** (D_W - 1) * MOTOR_LEG.lsb * 2**DROP_D
    beta = 2 * (drops + MOTOR_LEG.lsb * 2**DROP_D) + SQRT3.fmt.lsb / 2 * widest
    return {
        "lambda_alpha": FLUX.lsb + (drops + MOTOR_LEG.lsb) / 2**CLOCKS_BITS,
        "lambda_beta": FLUX.lsb + beta / 2**CLOCKS_BITS,
    }


def stimuli(_rng, _config):
    """From a start with either sign into both limits of the state, each component; drops that reach the leg's limit.

    From alpha's limit back by all bits that the output does not show: each of them moves the output.
    """
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers}
    rows = []
    for psi in (FLUX.hi, FLUX.lo, 0):
        for sign in (1, -1):
            end = {1: MOTOR_LEG.hi, -1: MOTOR_LEG.lo}[sign]
            other = MOTOR_LEG.lo + MOTOR_LEG.hi - end
            rows.append(still | {"start": 1, "psi_start": psi, "leg_a": end})
            rows += [still | {"leg_a": end, "leg_b": other, "leg_c": other, "psi_start": psi}] * 3
            rows.append(still | {"leg_b": sign * HIDDEN})
            rows += [still | {"leg_b": end, "leg_c": other}] * 3
            rows += [still | {"r_a": DROP_R.hi, "i_a": sign * PU.hi, "leg_a": other, "i_b": 1, "r_b": 1 << 14}] * 2
    for k in (-2, -1, 0, 1, 2):  # ties of the drop's rounding and of the difference's
        rows += [still | {"r_b": 1 << 14, "i_b": k}, still | {"leg_b": 16 + k}, still | {"leg_c": 16 + k}]
    return rows


def patient_stimuli(_rng, _config):
    """Beta, which starts at zero, into both limits and back from them as alpha in `stimuli`."""
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers}
    most = ((1 << (D_W - 1)) - 1) << DROP_D  # the largest difference of two legs
    rows = [still | {"start": 1}]
    for sign, steps in ((1, 640), (-1, 1280)):
        rows += [still | {"leg_b": sign * (most >> 1), "leg_c": -sign * (most >> 1)}] * steps
        rows += [still | {"leg_c": 32 * sign * d} for d in BACK]
    return rows


BLOCK = Block(
    name="motor_flux",
    folder="motor",
    paper="docs/hil.md: d lambda/dt = u - R i",
    step=step,
    inputs=(
        *(Port(f"leg_{x}", MOTOR_LEG, doc=f"voltage of leg {x}, summed over the step's clocks") for x in "abc"),
        *(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in "abc"),
        Port("start", BIT, doc="1: begin with psi_start"),
    ),
    registers=(
        *(Port(f"r_{x}", DROP_R, doc=f"resistance of phase {x}: voltage times clocks of a step") for x in "abc"),
        Port("psi_start", FLUX, doc="flux linkage at the start, alpha axis"),
    ),
    outputs=(
        Port("lambda_alpha", FLUX, doc="flux linkage, alpha"),
        Port("lambda_beta", FLUX, doc="flux linkage, beta"),
    ),
    state=State(),
    latency=9,
    interval=10,
    constants={
        "DROP_RI": DROP_RI,
        "DROP_D": DROP_D,
        "DROP_BETA": DROP_BETA,
        "DROP_OUT": DROP_OUT,
        "SQRT3": SQRT3,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
