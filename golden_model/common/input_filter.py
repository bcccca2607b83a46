# SPDX-License-Identifier: BSD-3-Clause
"""One asynchronous pin: synchroniser, then a filter that accepts a level only after it has stayed for a while.

Two registers synchronise the pin to the clock.  A level other than the output's is accepted when it has been there for
``filter_clocks`` + 1 clocks without a break: a pulse of ``filter_clocks`` clocks or fewer has no effect.
After a reset the output follows the synchroniser until it has been still for that time, then ``settled`` is 1: the
first level of a pin is not an edge.
Delay from pin to output: ``filter_clocks`` + 3 clocks.  Formats: clocks.  Rounding: none.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

FILTER = Format(0, 10, 0)
FILLED = 2  # clocks until the synchroniser holds the pin's level


class State(NamedTuple):
    sync_1: int = 0
    sync_2: int = 0
    fill: int = 0
    level: int = 0
    elapsed: int = 0  # clocks that the synchronised level has differed; before settled: has been the same
    settled: int = 0


@kernel
def step(state, pin, filter_clocks):
    s = state
    filled = s.fill == FILLED
    differs = s.sync_2 != s.level
    counting = filled and differs == (s.settled == 1)
    accept = counting and s.elapsed >= filter_clocks

    fill = s.fill if filled else s.fill + 1
    level = s.sync_2 if accept or not s.settled else s.level
    elapsed = s.elapsed + 1 if counting and not accept else 0
    settled = 1 if s.settled or accept else 0
    return State(pin, s.sync_1, fill, level, elapsed, settled), (level, settled)


def stimuli(rng, config):
    """Pulses one clock below, at and above the limit, bounce, times from none to the longest, high from the start."""
    rows = []

    def hold(pin, clocks, time):
        rows.extend({"pin": pin, "filter_clocks": time} for _ in range(clocks))

    for time in (0, 1, 2, 7, FILTER.hi):
        hold(1, time + 8, time)
        for width in (time, time + 1, time + 2, 1, 2):
            for level in (0, 1, 0):
                hold(level, max(width, 1), time)
            hold(0, time + 4, time)
        hold(1, 2 * time + 8, time)
    for _ in range(60):
        hold(int(rng.integers(2)), int(rng.integers(1, 14)), 5)
    return rows


BLOCK = Block(
    name="input_filter",
    folder="common",
    paper="none: pins of a board",
    step=step,
    inputs=(Port("pin", BIT, doc="asynchronous pin"),),
    registers=(Port("filter_clocks", FILTER, doc="longest pulse without effect, clocks"),),
    outputs=(
        Port("level", BIT, doc="the pin, synchronous and filtered"),
        Port("settled", BIT, doc="1: level is the pin's, 0: still unknown after a reset"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
