"""Turns a vector by the angle whose sine and cosine are given, two multipliers in two clocks.

    out_x = x*cos_theta - y*sin_theta
    out_y = x*sin_theta + y*cos_theta

Formats: products exact, 32 fraction bits; sums rounded half up to PU.
Saturation: a vector with both components near 2 per unit turned by 45 degrees reaches 2.83; a current
or voltage of that length is outside every base, see the conditioning blocks.
"""

import math

from golden_model.block import Block, Port
from golden_model.fixed import round_sat
from golden_model.formats import PU, PU_W, TRIG, TRIG_ONE
from golden_model.kernel import kernel

DROP = TRIG.frac_bits


@kernel
def step(x, y, cos_theta, sin_theta):
    sum_x = x * cos_theta - y * sin_theta
    sum_y = x * sin_theta + y * cos_theta
    return round_sat(sum_x, DROP, PU_W), round_sat(sum_y, DROP, PU_W)


def reference(v, _state):
    c, s = v["cos_theta"], v["sin_theta"]
    return {"out_x": PU.limit(v["x"] * c - v["y"] * s), "out_y": PU.limit(v["x"] * s + v["y"] * c)}


def bound(_v, _state):
    return {"out_x": PU.lsb / 2, "out_y": PU.lsb / 2}


def unit_vectors(x, y):
    """Stimuli shared by the three rotations: the axes, the diagonals, and full-length vectors."""

    def stimuli(_rng, _config):
        rows = []
        for k in range(16):
            c, s = round(TRIG_ONE * math.cos(k * math.pi / 8)), round(TRIG_ONE * math.sin(k * math.pi / 8))
            for a, b in ((PU.hi, 0), (0, PU.lo), (PU.hi, PU.hi), (PU.lo, PU.lo), (1, -1), (0, 0)):
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
    inputs=(Port("x", PU, doc="first component"), Port("y", PU, doc="second component"), *TRIG_PORTS),
    outputs=(
        Port("out_x", PU, doc="first component, turned"),
        Port("out_y", PU, doc="second component, turned"),
    ),
    latency=4,
    interval=2,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
    stimuli=unit_vectors("x", "y"),
)
