# SPDX-License-Identifier: BSD-3-Clause
"""Two products that are added or subtracted, as a rotation or a cross product needs them.

    y = saturate(round_half_up(c*d + a*b, DROP))      sum_of_products
    y = saturate(round_half_up(c*d - a*b, DROP))      difference_of_products, minus = 1

Formats: y has DROP fraction bits less than the products.  Rounded half up once, at the end; overflow saturates.
In the RTL, c and d enter a clock after a, b and minus.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_sat
from golden_model.formats import BIT
from golden_model.kernel import kernel


@kernel
def sum_of_products(a, b, c, d, drop, width):
    """(c*d + a*b) / 2**drop, rounded half up and saturated to ``width`` bits."""
    return round_sat(c * d + a * b, drop, width)


@kernel
def difference_of_products(a, b, c, d, drop, width):
    """(c*d - a*b) / 2**drop, rounded half up and saturated to ``width`` bits."""
    return round_sat(c * d - a * b, drop, width)


@kernel
def step(a, b, minus, c, d, a_w, b_w, c_w, d_w, y_w, drop):
    if minus:
        return (difference_of_products(a, b, c, d, drop, y_w),)
    return (sum_of_products(a, b, c, d, drop, y_w),)


def reference(v, _state):
    top = 2.0 ** (v["Y_W"] - 1)
    ab = -v["a"] * v["b"] if v["minus"] else v["a"] * v["b"]
    return {"y": min(max((v["c"] * v["d"] + ab) / 2.0 ** v["DROP"], -top), top - 1)}


def bound(_v, _state):
    return {"y": 0.5}


def _config(a_w, b_w, c_w, d_w, y_w, drop):
    return {"A_W": a_w, "B_W": b_w, "C_W": c_w, "D_W": d_w, "Y_W": y_w, "DROP": drop}


def _sized(width: str):
    return lambda config: Format(1, config[width] - 1, 0)


def stimuli(_rng, config):
    """Ties of the rounding and their neighbours, from either product and from both, with both signs."""
    tie = 1 << (config["DROP"] - 1)
    a_top, c_top = 1 << (config["A_W"] - 1), 1 << (config["C_W"] - 1)
    rows = []
    for sign in (1, -1):
        for k in (tie - 1, tie, tie + 1, 3 * tie):
            for minus in (0, 1):
                rows += [
                    {"a": sign * k, "b": 1, "c": 0, "d": 1, "minus": minus},
                    {"a": 0, "b": 1, "c": sign * k, "d": 1, "minus": minus},
                    {"a": sign * k, "b": -1, "c": sign * k, "d": 1, "minus": minus},
                ]
    return [row for row in rows if -a_top <= row["a"] < a_top and -c_top <= row["c"] < c_top]


BLOCK = Block(
    name="sum_of_products",
    folder="common",
    paper="the rotations and cross products in all equations",
    step=step,
    inputs=(
        Port("a", Format(1, 17, 0), doc="first factor of the product that is added or subtracted"),
        Port("b", Format(1, 17, 0), doc="its second factor"),
        Port("minus", BIT, doc="1: subtracted"),
        Port("c", Format(1, 17, 0), doc="first factor of the other product, a clock later"),
        Port("d", Format(1, 17, 0), doc="its second factor, a clock later"),
    ),
    outputs=(Port("y", Format(1, 17, 0), doc="sum or difference"),),
    latency=3,
    strobes=False,
    width_from={"a": _sized("A_W"), "b": _sized("B_W"), "c": _sized("C_W"), "d": _sized("D_W"), "y": _sized("Y_W")},
    # The rotation's widths, with and without saturation; the widest operands; more bits cut than an operand has.
    configs=(
        _config(18, 18, 18, 18, 22, 16),
        _config(18, 18, 18, 18, 18, 16),
        _config(25, 18, 25, 18, 25, 16),
        _config(25, 18, 18, 18, 20, 24),
    ),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
