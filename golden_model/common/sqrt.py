# SPDX-License-Identifier: BSD-3-Clause
"""Square root by table and chord, never above the true root.

    x = mantissa * 4**-shift, mantissa in [1/4, 1)
    root(mantissa) = BASE(address) + SLOPE(address)*rest;   sqrt(x) = root * 2**-shift

Formats: x U(0,32); mantissa cut to 20 bits: 8 of address (64..255), 12 of rest; base and slope U(0,18),
floored; product and result floored.  Every step errs downwards and the chord of a concave curve lies
below it, so 0 <= sqrt(x) - root < bound(): a voltage circle is never left by rounding.
"""

import math

import numpy as np

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import U_MAX
from golden_model.kernel import kernel

X = Format(0, 0, 32)
ADDRESS_BITS, REST_BITS = 8, 12
ROOT = Format(0, 0, 18)
SLOPE_FMT = Format(0, -8, 18)

_EDGES = [math.isqrt(k << (2 * ROOT.frac_bits - ADDRESS_BITS)) for k in range((1 << ADDRESS_BITS) + 1)]
_USED = range(1 << (ADDRESS_BITS - 2), 1 << ADDRESS_BITS)
BASE_ROM = tuple(_EDGES[k] if k in _USED else 0 for k in range(1 << ADDRESS_BITS))
SLOPE_ROM = tuple(_EDGES[k + 1] - _EDGES[k] if k in _USED else 0 for k in range(1 << ADDRESS_BITS))
BASE, SLOPE = np.array(BASE_ROM), np.array(SLOPE_ROM)
# What the RTL stores: base and slope in one word, doubled where the last bit of shift, the address' highest, is 0.  So
# every shift is odd there, one step of the shifter is in the table, and the table fills its block RAM.
CHORD = Format(0, 0, ROOT.width + SLOPE_FMT.width + 2)
CHORD_ROM = tuple(
    ((base << (SLOPE_FMT.width + 1)) + slope) << doubled
    for doubled in (1, 0)
    for base, slope in zip(BASE_ROM, SLOPE_ROM, strict=True)
)

DROP_X = X.width - ADDRESS_BITS - REST_BITS
DROP_OUT = ROOT.frac_bits - U_MAX.frac_bits


@kernel
def step(x):
    shift = 0
    while shift < 15 and (x << (2 * shift)) < (1 << 30):
        shift += 1
    mantissa = (x << (2 * shift)) >> DROP_X
    address = mantissa >> REST_BITS
    rest = mantissa & ((1 << REST_BITS) - 1)
    fine = BASE[address] + ((SLOPE[address] * rest) >> REST_BITS)
    return (fine >> (DROP_OUT + shift),)


def reference(v, _state):
    return {"root": math.sqrt(v["x"])}


def bound(v, _state):
    """Chord, four floors, the cut mantissa (slope 1 at 1/4), all scaled back; then the last floor."""
    shift = 0 if v["x"] == 0 else max(0, math.ceil(-math.log(v["x"], 4)) - 1)
    chord = (2.0**-ADDRESS_BITS) ** 2 / 8 * 2
    inner = chord + 3 * ROOT.lsb + 2.0 ** -(ADDRESS_BITS + REST_BITS)
    return {"root": inner * 2.0**-shift + U_MAX.lsb}


def stimuli(_rng, _config):
    """Zero, every power of two and its neighbours, squares and their neighbours."""
    powers = [(1 << k) + d for k in range(32) for d in (-1, 0, 1)]
    squares = [s * s + d for s in (1, 2, 3, 255, 256, 4096, 32768, 65535) for d in (-1, 0, 1)]
    return [{"x": x} for x in (*powers, *squares, X.hi) if 0 <= x <= X.hi]


BLOCK = Block(
    name="sqrt",
    folder="common",
    paper="001, section 5.2: voltage limit of the current regulation",
    step=step,
    inputs=(Port("x", X, doc="radicand"),),
    outputs=(Port("root", U_MAX, doc="square root, never above the true one"),),
    latency=5,
    constants={
        "DROP_X": DROP_X,
        "DROP_OUT": DROP_OUT,
        "REST_BITS": REST_BITS,
        "BASE_BITS": ROOT.width + 1,
        "SLOPE_BITS": SLOPE_FMT.width + 1,
    },
    roms={"CHORD": (CHORD, list(CHORD_ROM))},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
