# SPDX-License-Identifier: BSD-3-Clause
"""A filter of first order between the phase currents and their converters, once a step of the motor.

    y += k*(i - y)                 k: a step's share of the time constant
    k = 0: no filter; y is as with the largest k, so that a filter which is switched on begins at the current

Formats: i PU, y S(1,39), its output and what is multiplied are cut to PU and S(1,22); k U(0,17).  The product has the
39 fraction bits of y, so nothing is rounded: y rests where its cut is i, and never leaves the range of i.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import PU
from golden_model.kernel import kernel

SHARE = Format(0, 0, 17)
FILTERED = Format(1, 1, 39)
SEEN = Format(1, 1, 22)  # what is multiplied of y
DROP_SEEN = FILTERED.frac_bits - SEEN.frac_bits
DROP_OUT = FILTERED.frac_bits - PU.frac_bits
LIFT = SEEN.frac_bits - PU.frac_bits
MOST = SHARE.hi
assert SHARE.frac_bits + SEEN.frac_bits == FILTERED.frac_bits


class State(NamedTuple):
    a: int = 0
    b: int = 0
    c: int = 0


@kernel
def followed(y, i, k):
    """The state of a phase after a step."""
    return y + k * ((i << LIFT) - (y >> DROP_SEEN))


@kernel
def step(state, i_a, i_b, i_c, k_filter):
    k = MOST if k_filter == 0 else k_filter
    s = State(followed(state.a, i_a, k), followed(state.b, i_b, k), followed(state.c, i_c, k))
    return s, (s.a >> DROP_OUT, s.b >> DROP_OUT, s.c >> DROP_OUT)


def reference(v, state):
    k = v["k_filter"] or MOST * SHARE.lsb
    before = {x: getattr(state, x) * FILTERED.lsb for x in "abc"}
    return {f"y_{x}": before[x] + k * (v[f"i_{x}"] - before[x]) for x in "abc"}


def bound(_v, _state):
    """The cut of what is multiplied, the cut of the output."""
    return dict.fromkeys(("y_a", "y_b", "y_c"), SEEN.lsb + PU.lsb)


def stimuli(_rng, _config):
    """Steps from end to end and back to rest, with each bit of k; the least that moves an output, from both sides."""
    rows = []
    for k in (0, 1, 2, MOST - 1, MOST, *(1 << n for n in range(2, SHARE.width))):
        for i in (PU.hi, PU.lo, 0, 1, -1, 5, 5):
            rows += [{"i_a": i, "i_b": -1 - i, "i_c": i // 3, "k_filter": k}] * 3
    for k in (MOST, MOST - 1, 1 << 16, 0):  # rest at both ends: nothing wraps
        for i in (PU.hi, PU.lo):
            rows += [{"i_a": i, "i_b": -1 - i, "i_c": i, "k_filter": k}] * 40
    return rows


BLOCK = Block(
    name="motor_filter",
    folder="motor",
    paper="docs/hil.md: sensors",
    step=step,
    inputs=tuple(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in "abc"),
    registers=(Port("k_filter", SHARE, doc="share of a step in the filter of the current sensors; 0: no filter"),),
    outputs=tuple(Port(f"y_{x}", PU, doc=f"filtered current of phase {x}") for x in "abc"),
    state=State(),
    latency=7,
    interval=7,
    atomic=True,
    constants={"DROP_SEEN": DROP_SEEN, "DROP_OUT": DROP_OUT, "LIFT": LIFT},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
