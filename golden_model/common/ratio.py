# SPDX-License-Identifier: BSD-3-Clause
"""The ratio of two magnitudes, two quotient bits per clock.

    ratio = dividend/divisor          its largest value where dividend >= divisor; ``full`` is 1 there

Formats: dividend and divisor are integers of one scale; ratio U(0,16).
Rounding: floored.  A divisor of zero gives the largest ratio.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT, PU_W
from golden_model.kernel import kernel

RATIO = Format(0, 0, 16)
BITS, HI = RATIO.frac_bits, RATIO.hi
DIVISOR = Format(0, PU_W, 0)


@kernel
def step(dividend, divisor, _width):
    if dividend >= divisor:
        return HI, 1
    return (dividend << BITS) // divisor, 0


def reference(v, _state):
    whole = v["dividend"] >= v["divisor"]
    return {"ratio": RATIO.hi * RATIO.lsb if whole else v["dividend"] / v["divisor"]}


def bound(_v, _state):
    return {"ratio": RATIO.lsb}


def stimuli(rng, config):
    """Equal, one above and below, zeros, ends, and every ratio of small numbers."""
    top, most = (1 << config["DIVIDEND_W"]) - 1, DIVISOR.hi
    rows = [{"dividend": n, "divisor": d} for n in (0, 1, 2, most, top) for d in (0, 1, 2, 3, most - 1, most)]
    rows += [{"dividend": d + e, "divisor": d} for d in (7, 1000, 131071, most - 1) for e in (-1, 0, 1)]
    for _ in range(100):
        divisor = int(2 ** rng.uniform(0, PU_W))
        rows.append({"dividend": int(rng.integers(0, divisor + 1)), "divisor": divisor})
    return rows


BLOCK = Block(
    name="ratio",
    folder="common",
    paper="none: docs/speed_range.md",
    step=step,
    inputs=(
        Port("dividend", Format(0, 24, 0), doc="what is divided"),
        Port("divisor", DIVISOR, doc="what it is divided by"),
    ),
    outputs=(
        Port("ratio", RATIO, doc="dividend/divisor"),
        Port("full", BIT, doc="1: the dividend is not below the divisor"),
    ),
    latency=1 + BITS // 2,
    interval=1 + BITS // 2,
    width_from={"dividend": lambda config: Format(0, config["DIVIDEND_W"], 0)},
    configs=({"DIVIDEND_W": 18}, {"DIVIDEND_W": 24}),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
