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
# What the RTL stores, one table for each quarter in use: the leading bit, always one there, is left out.
BASE_LOW, SLOPE_LOW = Format(0, -1, ROOT.frac_bits), Format(0, SLOPE_FMT.int_bits - 1, SLOPE_FMT.frac_bits)


def quarter(rom, fmt, number):
    """(format, integers) of the table of one quarter, without the bit above ``fmt``, which must be one."""
    size = 1 << (ADDRESS_BITS - 2)
    low = [value - (1 << fmt.width) for value in rom[number * size : (number + 1) * size]]
    if not all(0 <= value <= fmt.hi for value in low):
        raise ValueError(f"quarter {number} of the square root's table has an entry without its leading bit")
    return fmt, low


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
    constants={"DROP_X": DROP_X, "DROP_OUT": DROP_OUT, "REST_BITS": REST_BITS},
    roms={
        f"{name}_{number}": quarter(rom, fmt, number)
        for name, rom, fmt in (("BASE", BASE_ROM, BASE_LOW), ("SLOPE", SLOPE_ROM, SLOPE_LOW))
        for number in (1, 2, 3)
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
