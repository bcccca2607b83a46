# SPDX-License-Identifier: BSD-3-Clause
"""The current reference of the torque table beside i_d, in the circle.

    i_q_circle = limit(i_q_table of the last sample, +-i_q_max)        zero with ``use_table`` = 0

current_limit applies i_d with i_q_max one sample late; i_q waits for both, so that the three are of one table point.

Formats: PU; nothing is rounded.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import clamp
from golden_model.formats import BIT, PU
from golden_model.kernel import kernel


class State(NamedTuple):
    i_q: int = 0  # PU, of the last sample


@kernel
def step(state, i_q_table, i_q_max, use_table):
    return State(i_q_table if use_table else 0), (clamp(state.i_q, -i_q_max, i_q_max),)


def reference(v, state):
    return {"i_q_circle": min(max(state.i_q * PU.lsb, -v["i_q_max"]), v["i_q_max"])}


def bound(_v, _state):
    return {"i_q_circle": 0.0}


BLOCK = Block(
    name="current_reference",
    folder="control",
    paper="none: docs/speed_range.md",
    step=step,
    inputs=(
        Port("i_q_table", PU, doc="current reference of the table, q axis"),
        Port("i_q_max", PU, lo=0, doc="limit of the q axis, see current_limit"),
    ),
    registers=(Port("use_table", BIT, doc="1: current references from the torque table; i_q_ext is then a torque"),),
    outputs=(Port("i_q_circle", PU, doc="current reference of the table in the circle, q axis"),),
    state=State(),
    latency=1,
    reference=reference,
    bound=bound,
)
