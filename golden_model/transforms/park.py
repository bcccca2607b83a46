# SPDX-License-Identifier: BSD-3-Clause
"""Stator frame to rotor frame: the rotation by -theta_me.

    i_d =  i_alpha*cos_theta + i_beta*sin_theta
    i_q = -i_alpha*sin_theta + i_beta*cos_theta

Formats, rounding and range: those of rotate.  Rotating the swapped axes forwards
is the backward rotation.
"""

from dataclasses import replace

from golden_model.block import Block, Port
from golden_model.formats import PU
from golden_model.kernel import kernel
from golden_model.transforms import clarke, rotate


@kernel
def step(i_alpha, i_beta, cos_theta, sin_theta):
    i_q, i_d = rotate.step(i_beta, i_alpha, cos_theta, sin_theta)
    return i_d, i_q


def reference(v, _state):
    c, s = v["cos_theta"], v["sin_theta"]
    return {"i_d": v["i_alpha"] * c + v["i_beta"] * s, "i_q": v["i_beta"] * c - v["i_alpha"] * s}


def bound(_v, _state):
    return {"i_d": PU.lsb / 2, "i_q": PU.lsb / 2}


BLOCK = Block(
    name="park",
    folder="transforms",
    paper="001, eq. (9): T_alphabeta/dq",
    step=step,
    inputs=(
        replace(clarke.I_ALPHA, late=1),
        clarke.I_BETA,
        *rotate.TRIG_PORTS,
    ),
    outputs=(Port("i_d", PU, doc="current, d axis"), Port("i_q", PU, doc="current, q axis")),
    latency=rotate.BLOCK.latency,
    soon=("i_d",),
    interval=rotate.BLOCK.interval,
    reference=reference,
    bound=bound,
    stimuli=rotate.unit_vectors("i_alpha", "i_beta"),
    possible=rotate.on_circle,
)
