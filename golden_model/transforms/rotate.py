# SPDX-License-Identifier: BSD-3-Clause
"""Rotates a vector by the angle whose sine and cosine are given.

    out_x = x*cos_theta - y*sin_theta
    out_y = y*cos_theta + x*sin_theta

Formats: x and y PU; products exact, 16 fraction bits more; sums rounded half up to PU.
Range: the components of currents and voltages are limited to VECTOR, 1.375 per unit, so the vector is shorter than
1.95 at every angle and needs no limiter after the adder.
"""

import math

from golden_model.block import Block, Port
from golden_model.common.sum_of_products import difference_of_products, sum_of_products
from golden_model.formats import PU, PU_W, TRIG, TRIG_ONE, VECTOR
from golden_model.kernel import kernel

DROP = TRIG.frac_bits


@kernel
def step(x, y, cos_theta, sin_theta):
    out_y = sum_of_products(x, sin_theta, y, cos_theta, DROP, PU_W)
    out_x = difference_of_products(y, sin_theta, x, cos_theta, DROP, PU_W)
    return out_x, out_y


def reference(v, _state):
    c, s = v["cos_theta"], v["sin_theta"]
    return {"out_x": v["x"] * c - v["y"] * s, "out_y": v["x"] * s + v["y"] * c}


def bound(_v, _state):
    return {"out_x": PU.lsb / 2, "out_y": PU.lsb / 2}


def on_circle(v, _config):
    """``v`` with sine and cosine replaced by those of the angle atan2(sin_theta, cos_theta)."""
    angle = math.atan2(v["sin_theta"], v["cos_theta"])
    return v | {"cos_theta": round(TRIG_ONE * math.cos(angle)), "sin_theta": round(TRIG_ONE * math.sin(angle))}


def unit_vectors(x, y, lo=-VECTOR, hi=VECTOR - 1):
    """Stimuli shared by the rotations: the axes, the diagonals, and vectors of full magnitude, lo to hi."""

    def stimuli(_rng, _config):
        rows = []
        for k in range(16):
            c, s = round(TRIG_ONE * math.cos(k * math.pi / 8)), round(TRIG_ONE * math.sin(k * math.pi / 8))
            for a, b in ((hi, 0), (0, lo), (hi, hi), (lo, lo), (1, -1), (0, 0)):
                rows.append({x: a, y: b, "cos_theta": c, "sin_theta": s})
        return rows

    return stimuli


TRIG_PORTS = (
    Port("cos_theta", TRIG, lo=-TRIG_ONE, hi=TRIG_ONE, doc="cosine of the angle"),
    Port("sin_theta", TRIG, lo=-TRIG_ONE, hi=TRIG_ONE, doc="sine of the angle"),
)

BLOCK = Block(
    name="rotate",
    folder="transforms",
    paper="001, eq. (9): T_dq/alphabeta",
    step=step,
    inputs=(
        Port("x", PU, lo=-VECTOR, hi=VECTOR - 1, doc="first component"),
        Port("y", PU, lo=-VECTOR, hi=VECTOR - 1, late=1, doc="second component"),
        *TRIG_PORTS,
    ),
    outputs=(
        Port("out_x", PU, doc="first component, rotated"),
        Port("out_y", PU, doc="second component, rotated"),
    ),
    latency=5,
    interval=4,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
    stimuli=unit_vectors("x", "y"),
    possible=on_circle,
)
