# SPDX-License-Identifier: BSD-3-Clause
"""Rotates a flux linkage by the angle whose sine and cosine are given, with two multipliers in two clocks.

    out_y = x*sin_theta + y*cos_theta
    out_x = x*cos_theta - y*sin_theta

Formats: x and y FLUX, the wide port of a multiplier; products exact, 16 fraction bits more; sums rounded half up to
FLUX.
Saturation: a flux with both components near 2 per unit rotated by 45 degrees reaches 2.83.
"""

from golden_model.block import Block, Port
from golden_model.fixed import round_sat
from golden_model.formats import FLUX, FLUX_W
from golden_model.kernel import kernel
from golden_model.transforms import rotate

DROP = rotate.DROP


@kernel
def component(x, y, first, second):
    """One component of the rotated flux."""
    return round_sat(x * first + y * second, DROP, FLUX_W)


@kernel
def step(x, y, cos_theta, sin_theta):
    out_y = component(x, y, sin_theta, cos_theta)
    out_x = component(x, y, cos_theta, -sin_theta)
    return out_x, out_y


def reference(v, _state):
    return {name: FLUX.limit(value) for name, value in rotate.reference(v, None).items()}


def bound(_v, _state):
    return {"out_x": FLUX.lsb / 2, "out_y": FLUX.lsb / 2}


def unit_vectors(x, y):
    """Stimuli of rotate, with fluxes of full magnitude."""
    return rotate.unit_vectors(x, y, FLUX.lo, FLUX.hi)


BLOCK = Block(
    name="flux_rotate",
    folder="transforms",
    paper="001, eq. (9): T_dq/alphabeta",
    step=step,
    inputs=(
        Port("x", FLUX, doc="first component"),
        Port("y", FLUX, doc="second component"),
        *rotate.TRIG_PORTS,
    ),
    outputs=(
        Port("out_x", FLUX, doc="first component, rotated"),
        Port("out_y", FLUX, doc="second component, rotated"),
    ),
    latency=6,
    interval=3,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
    stimuli=unit_vectors("x", "y"),
)
