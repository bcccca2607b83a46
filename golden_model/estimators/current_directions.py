# SPDX-License-Identifier: BSD-3-Clause
"""Predicted directions of the phase currents when the next sample's voltage acts: paper 000 eq. (6).

    turn = k_ahead*omega_me                                     rotation during 2.5 samples, in radians
    x = i_alpha - turn*i_beta,  y = i_beta + turn*i_alpha       the current vector, rotated ahead
    s_a = limit(k_sign*x, +-1)
    s_b = limit(k_sign*(-x + sqrt(3)*y)/2, +-1),  s_c = limit(k_sign*(-x - sqrt(3)*y)/2, +-1)
    s_alpha, s_beta = their Clarke transform

Prediction: the voltage of the next sample acts 2.5 sample times from now.  With the present directions each zero
crossing would be compensated late, and the remaining spike would increase the estimated loss: by 10 % at 300 rpm in
the paper's drive.  The rotation is replaced by its first-order term; the magnitude does not matter to a direction, and
the angle is too small by turn**3/3, one degree at 0.37 rad.
Near zero: eq. (6) gives zero the sign of a positive current, so noise around zero would switch a whole leg voltage.  In
a real leg the effect of dead time fades below the ripple current.  Within +-1/k_sign the direction is proportional to
the current.

Formats: turn, x, y PU; sqrt(3) U(1,16); sums saturated to PU, whose ends lie far outside the proportional
range; products with k_sign rounded half up.  All other operations are exact.
"""

import math

from golden_model.block import Block, Const, Port
from golden_model.common.multiply_add import multiply_add, multiply_subtract
from golden_model.fixed import Format, clamp, round_half_up, round_sat, saturate
from golden_model.formats import PU, PU_W
from golden_model.kernel import kernel
from golden_model.transforms import clarke

K_SIGN = Format(0, 12, 12)
K_AHEAD = Format(0, 1, 16)
ONE = 1 << PU.frac_bits
SQRT3 = Const(math.sqrt(3), Format(0, 1, 16))
K_SQRT3 = SQRT3.value
DROP_TURN = PU.frac_bits
DROP_SQRT3 = SQRT3.fmt.frac_bits
DROP = K_SIGN.frac_bits + 1  # the block calculates twice each phase current


@kernel
def direction(twice, k_sign):
    """The direction of one phase from twice its current."""
    return clamp(round_half_up(saturate(twice, PU_W) * k_sign, DROP), -ONE, ONE)


@kernel
def step(i_alpha, i_beta, omega_me, k_ahead, k_sign):
    turn = round_sat(omega_me * k_ahead, DROP_TURN, PU_W)
    x, _ = multiply_subtract(turn, i_beta, i_alpha, DROP_TURN, PU_W)
    y, _ = multiply_add(turn, i_alpha, i_beta, DROP_TURN, PU_W)
    across = round_half_up(y * K_SQRT3, DROP_SQRT3)
    return clarke.step(direction(2 * x, k_sign), direction(across - x, k_sign), direction(-across - x, k_sign))


def twice_currents(v):
    """Twice the phase currents, rotated ahead, in real numbers."""
    turn = PU.limit(v["omega_me"] * v["k_ahead"])
    x, y = PU.limit(v["i_alpha"] - turn * v["i_beta"]), PU.limit(v["i_beta"] + turn * v["i_alpha"])
    across = math.sqrt(3) * y
    return {"a": 2 * x, "b": across - x, "c": -across - x}


def reference(v, _state):
    a, b, c = (min(max(v["k_sign"] / 2 * PU.limit(x), -1.0), 1.0) for x in twice_currents(v).values())
    return {"s_alpha": (2 * a - b - c) / 3, "s_beta": (b - c) / math.sqrt(3)}


def bound(v, _state):
    """Errors of turn (half an LSB, and the end of PU) times a current below 2, of the products, of sqrt(3), of across.

    k_sign multiplies them into the error of a direction, at most two; the error of the Clarke transform is added.
    """
    xy = 2 * 1.5 * PU.lsb + PU.lsb / 2
    twice = xy + 1.8 * xy + 2 * SQRT3.fmt.lsb / 2 + PU.lsb
    direction_off = min(v["k_sign"] / 2 * twice + PU.lsb / 2, 2.0)
    own = clarke.bound({"i_a": 1.0, "i_b": 1.0, "i_c": 1.0}, None)
    return {
        "s_alpha": 4 / 3 * direction_off + 2 * own["i_alpha"],
        "s_beta": 2 / math.sqrt(3) * direction_off + 2 * own["i_beta"],
    }


def stimuli(rng, _config):
    """A rotating vector of several magnitudes and speeds; currents in and around the proportional range; the ends."""
    rows = []
    for omega, length in ((0, 20000), (65536, 20000), (-131072, 500), (131071, 131071)):
        for k in range(24):
            angle = k * math.pi / 12 + float(rng.uniform(0, 0.2))
            vector = {"i_alpha": round(length * math.cos(angle)), "i_beta": round(length * math.sin(angle))}
            rows.append({**vector, "omega_me": omega, "k_ahead": 20579, "k_sign": 200 << 12})
    for k_sign, edge in ((1 << 12, 65536), (1 << 18, 1024), (1 << 23, 32), ((1 << 24) - 1, 16)):
        for i in (0, 1, -1, edge // 2, edge - 1, edge, edge + 1, -edge, PU.hi, PU.lo):
            rows.append({"i_alpha": i, "i_beta": -i // 2, "omega_me": 0, "k_ahead": 0, "k_sign": k_sign})
    return rows


BLOCK = Block(
    name="current_directions",
    folder="estimators",
    paper="000, eq. (6)",
    step=step,
    inputs=(
        Port("i_alpha", PU, doc="current, alpha"),
        Port("i_beta", PU, doc="current, beta"),
        Port("omega_me", PU, doc="electrical speed"),
    ),
    registers=(
        Port("k_ahead", K_AHEAD, doc="angle of 2.5 sample times in radians, per unit of speed"),
        Port("k_sign", K_SIGN, doc="1 / (current above which a direction is +-1)"),
    ),
    outputs=(
        Port("s_alpha", PU, doc="directions of the currents, alpha"),
        Port("s_beta", PU, doc="directions of the currents, beta"),
    ),
    latency=23,
    interval=23,
    constants={"ONE": ONE, "SQRT3": SQRT3, "DROP_TURN": DROP_TURN, "DROP_SQRT3": DROP_SQRT3, "DROP": DROP},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
