# SPDX-License-Identifier: BSD-3-Clause
"""Keeps the current references in the circle of radius i_max, d axis first, whatever the source of the references.

    i_d     = limit(i_d_ref, +-i_max)
    i_q_max = floor(sqrt(i_max**2 - i_d**2)), the limit of i_q in speed mode and in torque mode
            = floor(sqrt((i_max - i_d)*(i_max + i_d)))

Both apply to the next sample, as a pair: the root is calculated bit by bit, without a multiplier, beside everything
else, and no sample sees an i_d with the i_q_max of another.  i_d_ref and i_max therefore act one sample late.
i_d**2 + i_q_max**2 <= i_max**2: nothing is rounded but the root, which is floored.

Formats: i_d and i_q_max PU, radicand exact.
"""

import math
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import clamp
from golden_model.formats import PU, PU_W
from golden_model.kernel import kernel

STEPS = 2 * PU_W - 1  # clocks: a bit of the product each, then a bit of the root each


class State(NamedTuple):
    i_d: int = 0  # PU, of the last sample
    i_q_max: int = 0


@kernel
def step(state, i_d_ref, i_max):
    i_d = clamp(i_d_ref, -i_max, i_max)
    radicand = (i_max - i_d) * (i_max + i_d)
    i_q_max = int(math.sqrt(radicand))  # exact: a double has more than twice the radicand's 34 bits of the root
    return State(i_d, i_q_max), (state.i_d, state.i_q_max)


def stimuli(rng, _config):
    """Circles of every size; i_d at the circle, beyond it, near it, zero; radicands at squares and beside them."""
    rows = [{"i_d_ref": 0, "i_max": 0}]
    for i_max in (0, 1, 2, 3, 5, 25, 65536, PU.hi - 1, PU.hi, *(int(2 ** rng.uniform(2, 17)) for _ in range(8))):
        for i_d in (0, 1, i_max * 3 // 5, i_max * 4 // 5 + 1, i_max - 1, i_max, i_max + 1, PU.hi):
            rows += [{"i_d_ref": max(PU.lo, min(PU.hi, s * i_d)), "i_max": i_max} for s in (1, -1)]
    rows += [{"i_d_ref": PU.lo, "i_max": i_max} for i_max in (0, 1, 30000, PU.hi)]
    for _ in range(40):  # pythagorean triples: the radicand is a square
        m, n, k = int(rng.integers(2, 40)), int(rng.integers(1, 40)), int(rng.integers(1, 30))
        a, c = abs(m * m - n * n) * k, (m * m + n * n) * k
        rows += [{"i_d_ref": a + off, "i_max": c} for off in (-1, 0, 1)]
    return rows


BLOCK = Block(
    name="current_limit",
    folder="control",
    paper="none: limit of the current, as the voltage's in paper 001, section 5.2",
    step=step,
    inputs=(Port("i_d_ref", PU, doc="current reference, d axis"),),
    registers=(Port("i_max", PU, lo=0, doc="limit of the current: radius of the circle of i_d and i_q references"),),
    outputs=(
        Port("i_d_limited", PU, doc="current reference in force, d axis"),
        Port("i_q_max", PU, lo=0, doc="limit of the q axis beside it"),
    ),
    state=State(),
    latency=1,
    interval=STEPS + 1,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
