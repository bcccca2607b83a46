# SPDX-License-Identifier: BSD-3-Clause
"""The sample of the core: when both the codes of the converters and the position of a trigger are there.

    sample_valid = the later of codes_valid and position_done since the last sample_trigger

What is missing at the next trigger is forgotten: such a trigger has no sample, and the core's watchdog runs.
What comes at the clock of a trigger belongs to that trigger.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.formats import BIT
from golden_model.kernel import kernel


class State(NamedTuple):
    codes: int = 0  # 1: the codes of this trigger have come
    position: int = 0  # 1: its position has come
    valid: int = 0


@kernel
def step(state, sample_trigger, codes_valid, position_done):
    s = state
    codes = 1 if codes_valid or (s.codes and not sample_trigger) else 0
    position = 1 if position_done or (s.position and not sample_trigger) else 0
    both = 1 if codes and position else 0
    following = State(0 if both else codes, 0 if both else position, both)
    return following, (both,)


BLOCK = Block(
    name="sample_join",
    folder="io",
    paper="none: front end of a board",
    step=step,
    inputs=(
        Port("sample_trigger", BIT, doc="1: a sample begins"),
        Port("codes_valid", BIT, doc="1: the codes of the converters are there"),
        Port("position_done", BIT, doc="1: position and speed are there"),
    ),
    outputs=(Port("sample_valid", BIT, doc="1: all of the sample is there"),),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=lambda rng, _config: [
        dict(zip(("sample_trigger", "codes_valid", "position_done"), map(int, rng.random(3) < chance), strict=True))
        for chance in (0.05, 0.2, 0.5)
        for _ in range(500)
    ],
)
