# SPDX-License-Identifier: BSD-3-Clause
"""Rotor frame to stator frame: the rotation by theta.

    u_alpha = u_d*cos_theta - u_q*sin_theta
    u_beta  = u_d*sin_theta + u_q*cos_theta

Formats, rounding and range: those of rotate; the voltage is within the circle, below 1 per unit.
"""

from golden_model.block import Block, Port
from golden_model.formats import PU, VECTOR
from golden_model.kernel import kernel
from golden_model.transforms import rotate


@kernel
def step(u_d, u_q, cos_theta, sin_theta):
    return rotate.step(u_d, u_q, cos_theta, sin_theta)


def reference(v, _state):
    c, s = v["cos_theta"], v["sin_theta"]
    return {"u_alpha": v["u_d"] * c - v["u_q"] * s, "u_beta": v["u_d"] * s + v["u_q"] * c}


def bound(_v, _state):
    return {"u_alpha": PU.lsb / 2, "u_beta": PU.lsb / 2}


BLOCK = Block(
    name="inverse_park",
    folder="transforms",
    paper="001, eq. (9): T_dq/alphabeta",
    step=step,
    inputs=(
        Port("u_d", PU, -VECTOR, VECTOR - 1, doc="voltage, d axis"),
        Port("u_q", PU, -VECTOR, VECTOR - 1, late=1, doc="voltage, q axis"),
        *rotate.TRIG_PORTS,
    ),
    outputs=(Port("u_alpha", PU, doc="voltage, alpha"), Port("u_beta", PU, doc="voltage, beta")),
    latency=rotate.BLOCK.latency,
    interval=rotate.BLOCK.interval,
    reference=reference,
    bound=bound,
    stimuli=rotate.unit_vectors("u_d", "u_q"),
    possible=rotate.on_circle,
)
