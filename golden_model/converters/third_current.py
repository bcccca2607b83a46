# SPDX-License-Identifier: BSD-3-Clause
"""The third phase current where two phases have a sensor: i_missing = -(i_x + i_y); a sample block.

``missing``: 0 all three phases have a sensor, 1, 2, 3: phase a, b, c has none.  It works on currents, after
current_conditioning:
raw codes have offsets and gains of their own.  The rail flag of the missing phase is cleared, since its code is no
measurement.

Saturation: the sum of two currents below 2 per unit is below 4; beyond 2 the third current saturates.  That cannot
hide an overcurrent: 2 per unit, floored to a 256th, is the largest i_trip, and a saturated current reaches it.
With a missing phase the sum of the three currents is zero, or the third is saturated: the check of the sum says
nothing.
Formats: PU, exact but for the saturation.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, saturate
from golden_model.formats import PU, PU_W
from golden_model.kernel import kernel

MISSING = Format(0, 2, 0)
RAILS = Format(0, 3, 0)


@kernel
def step(i_a, i_b, i_c, current_at_rail, missing):
    a, b, c = i_a, i_b, i_c
    if missing == 1:
        a = saturate(-(i_b + i_c), PU_W)
    elif missing == 2:
        b = saturate(-(i_a + i_c), PU_W)
    elif missing == 3:
        c = saturate(-(i_a + i_b), PU_W)
    rails = current_at_rail & ~((1 << missing) >> 1)
    return a, b, c, rails


def reference(v, _state):
    real = {x: v[f"i_{x}"] for x in "abc"}
    for number, x in enumerate("abc", 1):
        if v["missing"] * (1 << MISSING.frac_bits) == number:
            real[x] = PU.limit(-sum(v[f"i_{y}"] for y in "abc" if y != x))
    return {f"out_{x}": real[x] for x in "abc"}


def bound(_v, _state):
    return dict.fromkeys(("out_a", "out_b", "out_c"), 0.0)


def stimuli(_rng, _config):
    """Sums at the limits of the range and one beyond, each phase missing, each rail."""
    rows = []
    for missing in range(4):
        for total in (PU.lo, PU.lo - 1, -PU.lo, -PU.lo + 1, -PU.lo - 1, 0, 1, -1):
            half = total // 2
            rows += [dict(zip(("i_a", "i_b", "i_c"), row, strict=True), missing=missing, current_at_rail=rail)
                     for row in ((half, total - half, half), (half, half, total - half), (total - half, half, half))
                     for rail in range(8)]  # fmt: skip
    return rows


BLOCK = Block(
    name="third_current",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    inputs=tuple(Port(f"i_{x}", PU, doc=f"current, phase {x}") for x in "abc")
    + (Port("current_at_rail", RAILS, doc="bit x: ADC code of phase x at either end"),),
    registers=(Port("missing", MISSING, doc="0: three sensors, 1 to 3: phase a to c has none"),),
    outputs=tuple(Port(f"out_{x}", PU, doc=f"current, phase {x}, measured or computed") for x in "abc")
    + (Port("rails", RAILS, doc="bit x: ADC code of phase x at either end and measured"),),
    latency=1,
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
