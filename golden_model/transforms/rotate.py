"""Turns a vector by the angle whose sine and cosine are given, two multipliers in two clocks.

    out_x = x*cos_theta - y*sin_theta
    out_y = x*sin_theta + y*cos_theta

Formats: x and y have WIDTH bits, PU at 18 and FLUX at 25 (the wide port of a multiplier), two of them left of
the point; products exact, 16 fraction bits more; sums rounded half up to WIDTH bits.
Saturation: a vector with both components near 2 per unit turned by 45 degrees reaches 2.83; a current
or voltage of that length is outside every base, see the conditioning blocks.
"""

import math

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_sat
from golden_model.formats import FLUX_W, PU, PU_W, TRIG, TRIG_ONE
from golden_model.kernel import kernel

DROP = TRIG.frac_bits


@kernel
def step(x, y, cos_theta, sin_theta, width):
    sum_x = x * cos_theta - y * sin_theta
    sum_y = x * sin_theta + y * cos_theta
    return round_sat(sum_x, DROP, width), round_sat(sum_y, DROP, width)


def sized(config):
    """The format of vectors of WIDTH bits."""
    return Format(1, 1, config["WIDTH"] - 2)


def reference(v, _state):
    c, s, fmt = v["cos_theta"], v["sin_theta"], sized(v)
    return {"out_x": fmt.limit(v["x"] * c - v["y"] * s), "out_y": fmt.limit(v["x"] * s + v["y"] * c)}


def bound(v, _state):
    return dict.fromkeys(("out_x", "out_y"), sized(v).lsb / 2)


def unit_vectors(x, y, fmt=None):
    """Stimuli shared by the rotations: the axes, the diagonals, and full-length vectors of ``fmt`` or WIDTH."""

    def stimuli(_rng, config):
        ends, rows = fmt or sized(config), []
        for k in range(16):
            c, s = round(TRIG_ONE * math.cos(k * math.pi / 8)), round(TRIG_ONE * math.sin(k * math.pi / 8))
            for a, b in ((ends.hi, 0), (0, ends.lo), (ends.hi, ends.hi), (ends.lo, ends.lo), (1, -1), (0, 0)):
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
    inputs=(Port("x", PU, doc="first component"), Port("y", PU, late=1, doc="second component"), *TRIG_PORTS),
    outputs=(
        Port("out_x", PU, doc="first component, turned"),
        Port("out_y", PU, doc="second component, turned"),
    ),
    latency=5,
    interval=4,
    soon=("out_y",),
    constants={"DROP": DROP},
    configs=({"WIDTH": PU_W}, {"WIDTH": FLUX_W}),
    width_from=dict.fromkeys(("x", "y", "out_x", "out_y"), sized),
    reference=reference,
    bound=bound,
    stimuli=unit_vectors("x", "y"),
)
