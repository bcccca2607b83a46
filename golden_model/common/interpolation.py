# SPDX-License-Identifier: BSD-3-Clause
"""A point between two words.

    y = a + fraction*(b - a)

Formats: a, b and y of one width; fraction U(0,n).
Rounding: the product is floored.  y lies between a and b, so nothing overflows.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.kernel import kernel


@kernel
def between(a, b, fraction, bits):
    """a + fraction*(b - a), the product floored; fraction U(0,bits)."""
    return a + (((b - a) * fraction) >> bits)


@kernel
def step(a, b, fraction, _width, bits):
    return (between(a, b, fraction, bits),)


def reference(v, _state):
    return {"y": v["a"] + v["fraction"] * (v["b"] - v["a"])}


def bound(_v, _state):
    return {"y": 1.0}


def _word(config):
    return Format(1, config["WIDTH"] - 1, 0)


def stimuli(_rng, config):
    """Both ends of the words and of the fraction, equal words, and those beside them."""
    top, most = 1 << (config["WIDTH"] - 1), (1 << config["BITS"]) - 1
    words = (-top, -top + 1, -1, 0, 1, top - 2, top - 1)
    return [{"a": a, "b": b, "fraction": f} for a in words for b in words for f in (0, 1, most // 2, most - 1, most)]


BLOCK = Block(
    name="interpolation",
    folder="common",
    paper="none: docs/speed_range.md",
    step=step,
    inputs=(
        Port("a", Format(1, 17, 0), doc="first word"),
        Port("b", Format(1, 17, 0), doc="second word"),
        Port("fraction", Format(0, 0, 10), doc="part of the way from the first to the second"),
    ),
    outputs=(Port("y", Format(1, 17, 0), doc="the point between both"),),
    latency=3,
    strobes=False,
    width_from={
        "a": _word,
        "b": _word,
        "y": _word,
        "fraction": lambda config: Format(0, 0, config["BITS"]),
    },
    configs=({"WIDTH": 18, "BITS": 10}, {"WIDTH": 6, "BITS": 3}),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
