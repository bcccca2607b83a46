# SPDX-License-Identifier: BSD-3-Clause
"""The arithmetic that most equations of the core consist of: multiply, add, round, saturate.

    y = saturate(c + round_half_up(a*b, DROP))        multiply_add
    y = saturate(c - round_half_up(a*b, DROP))        multiply_subtract, MINUS = 1
    limited = 1 if y is saturated

Formats: a*b has DROP fraction bits more than c and y.  Rounded half up; overflow saturates and sets `overflow`.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, exceeds, round_half_up, saturate
from golden_model.formats import BIT
from golden_model.kernel import kernel


@kernel
def multiply_add(a, b, c, drop, width):
    """(c + a*b/2**drop rounded half up and saturated to ``width`` bits, 1 if it was saturated)."""
    exact = c + round_half_up(a * b, drop)
    return saturate(exact, width), exceeds(exact, width)


@kernel
def multiply_subtract(a, b, c, drop, width):
    """(c - a*b/2**drop rounded half up, saturated to ``width`` bits, 1 if it was saturated)."""
    exact = c - round_half_up(a * b, drop)
    return saturate(exact, width), exceeds(exact, width)


@kernel
def step(a, b, c, a_w, b_w, c_w, y_w, drop, minus):
    if minus:
        return multiply_subtract(a, b, c, drop, y_w)
    return multiply_add(a, b, c, drop, y_w)


def _real(v):
    scaled = v["a"] * v["b"] / 2.0 ** v["DROP"]
    return v["c"] - scaled if v["MINUS"] else v["c"] + scaled


def reference(v, _state):
    top = 2.0 ** (v["Y_W"] - 1)
    return {"y": min(max(_real(v), -top), top - 1)}


def bound(v, _state):
    return {"y": 0.5 if v["DROP"] else 0.0}


def _config(a_w, b_w, c_w, y_w, drop, minus=0):
    return {"A_W": a_w, "B_W": b_w, "C_W": c_w, "Y_W": y_w, "DROP": drop, "MINUS": minus}


def _sized(width: str):
    return lambda config: Format(1, config[width] - 1, 0)


def stimuli(_rng, config):
    """Ties of the rounding and their neighbours, both signs; sums at both ends of y and just beyond them."""
    a_top, drop = 1 << (config["A_W"] - 1), config["DROP"]
    tie = 1 << max(drop - 1, 0)
    rows = [{"a": s * k, "b": 1, "c": c} for s in (1, -1) for k in (tie - 1, tie, tie + 1, 3 * tie) for c in (0, -1)]
    end = min(1 << (config["Y_W"] - 1), 1 << (config["C_W"] - 1))
    lsb = 1 << drop
    if lsb < a_top:
        rows += [{"a": s * lsb, "b": b, "c": c} for s in (1, -1) for b in (-1, 0, 1) for c in (end - 1, -end)]
    return [row for row in rows if -a_top <= row["a"] < a_top]


BLOCK = Block(
    name="multiply_add",
    folder="common",
    paper="the sums of products in all equations",
    step=step,
    inputs=(
        Port("a", Format(1, 24, 0), doc="first factor"),
        Port("b", Format(1, 17, 0), doc="second factor"),
        Port("c", Format(1, 24, 0), doc="the other term of the sum"),
    ),
    outputs=(Port("y", Format(1, 24, 0), doc="sum or difference"), Port("limited", BIT, doc="y is saturated")),
    latency=3,
    strobes=False,
    width_from={"a": _sized("A_W"), "b": _sized("B_W"), "c": _sized("C_W"), "y": _sized("Y_W")},
    # The widest operands of a DSP48 with both signs, exact products, a term wider and one narrower than the product.
    configs=(
        _config(25, 18, 25, 25, 18),
        _config(25, 18, 25, 25, 18, 1),
        _config(18, 22, 38, 38, 2),
        _config(18, 18, 30, 30, 6, 1),
        _config(18, 18, 36, 37, 0),
        _config(25, 18, 1, 18, 18),
    ),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
