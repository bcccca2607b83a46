"""Turns a vector by the angle whose sine and cosine are given, two multipliers in two clocks.

    out_x = x*cos_theta - y*sin_theta
    out_y = x*sin_theta + y*cos_theta

Formats: x and y have WIDTH bits, PU at 18 and FLUX at 25 (the wide port of a multiplier), two of them left of
the point; products exact, 16 fraction bits more; sums rounded half up to WIDTH bits.
Saturation: a flux with both components near 2 per unit turned by 45 degrees reaches 2.83.  Currents and voltages
come limited to VECTOR, 1.375 per unit, so they are shorter than 1.95 and need no limit behind the adder.
"""

import math

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up, round_sat
from golden_model.formats import FLUX_W, PU, PU_W, TRIG, TRIG_ONE, VECTOR
from golden_model.kernel import kernel

DROP = TRIG.frac_bits


@kernel
def step(x, y, cos_theta, sin_theta, width):
    sum_x = x * cos_theta - y * sin_theta
    sum_y = x * sin_theta + y * cos_theta
    if width == PU_W:
        return round_half_up(sum_x, DROP), round_half_up(sum_y, DROP)
    return round_sat(sum_x, DROP, width), round_sat(sum_y, DROP, width)


def sized(config):
    """The format of vectors of WIDTH bits."""
    return Format(1, 1, config["WIDTH"] - 2)


def ends(config):
    """The lowest and the highest component of a vector that may be turned."""
    fmt = sized(config)
    return (-VECTOR, VECTOR - 1) if fmt == PU else (fmt.lo, fmt.hi)


def reference(v, _state):
    c, s, fmt = v["cos_theta"], v["sin_theta"], sized(v)
    return {"out_x": fmt.limit(v["x"] * c - v["y"] * s), "out_y": fmt.limit(v["x"] * s + v["y"] * c)}


def bound(v, _state):
    return dict.fromkeys(("out_x", "out_y"), sized(v).lsb / 2)


def on_circle(v):
    """``v`` with a sine and a cosine of one angle: of the angle that the two point to, 0 where they point nowhere."""
    angle = math.atan2(v["sin_theta"], v["cos_theta"])
    return v | {"cos_theta": round(TRIG_ONE * math.cos(angle)), "sin_theta": round(TRIG_ONE * math.sin(angle))}


def unit_vectors(x, y, width=None):
    """Stimuli shared by the rotations: the axes, the diagonals, and full-length vectors of ``width`` or WIDTH."""

    def stimuli(_rng, config):
        (lo, hi), rows = ends(config if width is None else {"WIDTH": width}), []
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
    inputs=(Port("x", PU, doc="first component"), Port("y", PU, late=1, doc="second component"), *TRIG_PORTS),
    outputs=(
        Port("out_x", PU, doc="first component, turned"),
        Port("out_y", PU, doc="second component, turned"),
    ),
    latency=5,
    interval=4,
    constants={"DROP": DROP},
    configs=({"WIDTH": PU_W}, {"WIDTH": FLUX_W}),
    width_from=dict.fromkeys(("x", "y", "out_x", "out_y"), sized),
    range_from=dict.fromkeys(("x", "y"), ends),
    reference=reference,
    bound=bound,
    stimuli=unit_vectors("x", "y"),
    possible=on_circle,
)
