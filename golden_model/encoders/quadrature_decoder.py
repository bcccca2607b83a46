# SPDX-License-Identifier: BSD-3-Clause
"""A, B and Z of an incremental encoder to steps of a quarter line, direction, index and illegal transitions.

A leads B forward: (a, b) = 00, 10, 11, 01 are the phases 0 to 3.  One phase on is a step up, one back a step down; a
change by two phases is illegal: it gives no step and is counted in ``illegal_count``, which saturates.
``index`` comes when Z is 1 in phase ``index_phase``, once for each entry.  A quarter of a line is one place of the
shaft whatever the direction, so both directions find the same count, also after a reversal within Z.  This needs
a Z of at most one line (4 counts) that covers one quarter of that phase.
Inputs are read from ``settled`` on; the first phase is not a step.
Formats: bits.  Rounding: none.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

PHASE = Format(0, 2, 0)
EVENTS = Format(0, 12, 0)
EVENTS_MAX = EVENTS.hi


class State(NamedTuple):
    phase: int = 0
    seen: int = 0
    at_index: int = 0
    forward: int = 0
    illegal_count: int = 0


@kernel
def step(state, a, b, z, settled, clear_faults, index_phase):
    s = state
    phase = 2 * b + (a ^ b)
    change = (phase - s.phase) & 3 if s.seen and settled else 0
    step_up = 1 if change == 1 else 0
    step_down = 1 if change == 3 else 0
    illegal = 1 if change == 2 else 0
    at_index = 1 if settled and z and phase == index_phase else 0
    index = 1 if at_index and not s.at_index else 0

    forward = 1 if step_up or (s.forward and not step_down) else 0
    counted = 0 if clear_faults else s.illegal_count
    counted = min(counted + illegal, EVENTS_MAX)
    following = State(phase, settled, at_index, forward, counted)
    return following, (step_up, step_down, forward, index, illegal, counted)


def lines(phase):
    """(a, b) of a phase 0 to 3."""
    return {0: (0, 0), 1: (1, 0), 2: (1, 1), 3: (0, 1)}[phase & 3]


def stimuli(rng, config):
    """Every transition of two phases with every Z, both directions with an index at every phase, illegal ones."""
    rows = []

    def show(phase, z=0, clocks=1, **more):
        a, b = lines(phase)
        row = {"a": a, "b": b, "z": z, "settled": 1, "clear_faults": 0, "index_phase": 0} | more
        rows.extend(dict(row) for _ in range(clocks))

    show(2, settled=0, clocks=3)
    for now in range(4):
        for then in range(4):
            for z in range(4):
                show(now, z & 1, index_phase=then)
                show(then, z >> 1, index_phase=then)
    for phase in range(4):
        for direction in (1, -1):
            for k in range(40):
                place = direction * k
                show(place, int(place % 24 < 4), index_phase=phase, clocks=int(rng.integers(1, 4)))
    show(0)
    for k in range(EVENTS_MAX + 4):
        show(2 * (k & 1))
    show(0, clear_faults=1, clocks=2)
    show(2, clear_faults=1)
    show(2, settled=0)
    show(1, settled=1)
    return rows


BLOCK = Block(
    name="quadrature_decoder",
    folder="encoders",
    paper="none: incremental encoder",
    step=step,
    inputs=(
        Port("a", BIT, doc="A, filtered"),
        Port("b", BIT, doc="B, filtered"),
        Port("z", BIT, doc="Z, filtered"),
        Port("settled", BIT, doc="1: a, b and z are valid"),
        Port("clear_faults", BIT, doc="1: clear illegal_count"),
    ),
    registers=(Port("index_phase", PHASE, doc="phase of A and B in which Z marks the index"),),
    outputs=(
        Port("step_up", BIT, doc="1: a count forward"),
        Port("step_down", BIT, doc="1: a count backward"),
        Port("forward", BIT, doc="1: the last step was forward"),
        Port("index", BIT, doc="1: the index was entered"),
        Port("illegal", BIT, doc="1: A and B changed together"),
        Port("illegal_count", EVENTS, doc="illegal transitions, saturates"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
