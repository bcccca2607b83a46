# SPDX-License-Identifier: BSD-3-Clause
"""The second encoder of a board, the master of gear: A and B from the pins to a code of 18 bits a turn.

Two filters, a decoder and a counter, as in incremental_encoder, without an index: a gear needs the way of its master,
not its place.  ``sample_trigger`` latches the code.  A transition that A and B cannot make is counted in
``master_illegal``: from there on the phase of the gear is off by what was missed.  MASTER = 0: nothing is built.
Formats: those of the blocks.
"""

from collections import namedtuple
from dataclasses import replace
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common import input_filter
from golden_model.encoders import quadrature_decoder, turn_counter
from golden_model.encoders.quadrature_decoder import EVENTS, lines
from golden_model.formats import BIT, TURN, TURN_W
from golden_model.kernel import kernel

filter_step, decoder_step, counter_step = input_filter.step, quadrature_decoder.step, turn_counter.step


class State(NamedTuple):
    of_filter_a: input_filter.State = input_filter.State()
    of_filter_b: input_filter.State = input_filter.State()
    of_decoder: quadrature_decoder.State = quadrature_decoder.State()
    of_counter: turn_counter.State = turn_counter.State()
    # Outputs that the next clock reads
    step_up: int = 0
    step_down: int = 0


@kernel
def step(state, inputs, regs, master):
    s, x, r = state, inputs, regs
    if not master:
        return s, (0, 0)
    filter_a, (_, _) = filter_step(s.of_filter_a, x.master_a, r.filter_clocks)
    filter_b, (_, _) = filter_step(s.of_filter_b, x.master_b, r.filter_clocks)
    settled = 1 if s.of_filter_a.settled and s.of_filter_b.settled else 0
    decoder, (step_up, step_down, _, _, _, master_illegal) = decoder_step(
        s.of_decoder, s.of_filter_a.level, s.of_filter_b.level, 0, settled, x.clear_encoder, 0
    )
    counter, (master_code, _, _, _, _, _) = counter_step(
        s.of_counter, s.step_up, s.step_down, x.sample_trigger, 0, 0, 0, r.master_counts, r.master_step, r.master_rest,
        TURN_W,
    )  # fmt: skip
    following = State(filter_a, filter_b, decoder, counter, step_up, step_down)
    return following, (master_code, master_illegal)


def setting(counts):
    """The registers of a master of ``counts`` counts a turn; ValueError where the counter would refuse it."""
    found = turn_counter.setting(counts, TURN_W)
    return {f"master_{name.removeprefix('code_')}": value for name, value in found.items()}


def stimuli(rng, _config):
    """Turns in both directions with bounce and samples all the while, counts of every size, illegal transitions."""
    rows, still = [], {"clear_encoder": 0, "filter_clocks": 2}

    def show(place, clocks, **more):
        a, b = lines(place)
        for k in range(clocks):
            bounce = int(k == 1 and rng.integers(3) == 0)
            row = {"master_a": a ^ bounce, "master_b": b, "sample_trigger": int(rng.integers(12) == 0)}
            rows.append(still | row | more)

    for counts in (5, 60, 4000, turn_counter.COUNTS_MAX):
        still |= setting(counts)
        show(0, 12)
        for place in [*range(70), *range(70, -40, -1)]:
            show(place, int(rng.integers(5, 9)))
    still["filter_clocks"] = 1
    for place in range(0, 40, 2):
        show(place, 5)
    show(38, 1, clear_encoder=1)
    show(38, 9)
    return rows


def patient_stimuli(_rng, _config):
    """As many illegal transitions as the counter's bits need."""
    still = {"clear_encoder": 0, "sample_trigger": 0, "filter_clocks": 1} | setting(4000)
    return [still | dict(zip(("master_a", "master_b"), lines(k // 4 * 2), strict=True)) for k in range(4 * 4200)]


_COUNTER = {p.name: p for p in turn_counter.BLOCK.registers}
INPUTS = (
    Port("master_a", BIT, doc="A of the master, asynchronous pin"),
    Port("master_b", BIT, doc="B of the master, asynchronous pin"),
    Port("sample_trigger", BIT, doc="1: latch the code"),
    Port("clear_encoder", BIT, doc="1: clear the count of illegal transitions"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    next(p for p in input_filter.BLOCK.registers if p.name == "filter_clocks"),
    replace(_COUNTER["counts"], name="master_counts", doc="counts a turn of the master, four for each line"),
    replace(_COUNTER["code_step"], name="master_step", doc="2**18 / master_counts, whole part"),
    replace(_COUNTER["code_rest"], name="master_rest", doc="2**18 / master_counts, remainder"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="master_encoder",
    folder="encoders",
    paper="none: incremental encoder",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("master_code", TURN, doc="position code of the master at the last sample"),
        Port("master_illegal", EVENTS, doc="illegal transitions of the master's A and B, saturates"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"MASTER": 1}, {"MASTER": 0}),
    too_wide=(1,),  # nothing is built, so there is nothing to draw
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
