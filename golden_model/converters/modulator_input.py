# SPDX-License-Identifier: BSD-3-Clause
"""Bits of delta-sigma modulators: makes their clock, or follows one, and registers their data; one step is one clock.

* ``follow_clock`` = 0: ``mod_clock`` has a period of ``mod_ratio`` clocks, high for the first half (rounded down).
  A bit is the level of its pin ``sample_delay`` clocks after the rising edge of ``mod_clock`` has left its register.
* ``follow_clock`` = 1: the clock comes with the data, high and low for at least two clocks each.  A bit is the level
  of its pin 2 + ``sample_delay`` clocks after the clock at which the pin of the modulator's clock was first high.

``mod_data`` and ``mod_clock_in`` are not synchronous and pass two registers.  ``sample_delay`` is chosen such that
the data are stable when they are taken; the registers settle what moves at any other time.
Formats: bits, clocks; nothing is computed.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

RATIO = Format(0, 6, 0)
DELAY = Format(0, 4, 0)
STROBES = 16  # values of sample_delay


class State(NamedTuple):
    tick: int = 0  # clock within a period of mod_clock
    clock_meta: int = 0
    clock_now: int = 0
    clock_before: int = 0
    data_meta: int = 0
    data_now: int = 0
    strobes: int = 0  # rising edges of the last clocks, the newest at bit 0


@kernel
def step(state, mod_data, mod_clock_in, mod_ratio, sample_delay, follow_clock, lines):
    s = state
    half = mod_ratio >> 1
    rises = 1 if s.clock_now and not s.clock_before else 0
    if not follow_clock:
        rises = 1 if s.tick == 0 else 0
    bits_valid = (s.strobes >> sample_delay) & 1

    tick = 0 if s.tick + 1 >= mod_ratio else s.tick + 1
    strobes = ((s.strobes << 1) | rises) & ((1 << STROBES) - 1)
    mod_clock = 1 if s.tick < half and not follow_clock else 0
    following = State(tick, mod_clock_in, s.clock_meta, s.clock_now, mod_data, s.data_meta, strobes)
    return following, (mod_clock, s.data_meta, bits_valid)


def stimuli(rng, config):
    """Every ratio and delay, the clock generated and followed, data that move at any clock."""
    top = (1 << config["LINES"]) - 1
    rows = []
    for ratio in range(4, 33):
        regs = {"mod_ratio": ratio, "sample_delay": int(rng.integers(16)), "follow_clock": int(ratio % 3 == 0)}
        for clock in range(4 * ratio):
            row = {"mod_data": int(rng.integers(top + 1)), "mod_clock_in": int(clock % ratio < ratio // 2)}
            rows.append(row | regs)
    return rows


BLOCK = Block(
    name="modulator_input",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    inputs=(
        Port("mod_data", Format(0, 3, 0), doc="data of the modulators, not synchronous"),
        Port("mod_clock_in", BIT, doc="clock of the modulators, not synchronous; only with follow_clock"),
    ),
    registers=(
        Port("mod_ratio", RATIO, lo=4, hi=32, doc="clocks of a period of mod_clock"),
        Port("sample_delay", DELAY, doc="clocks from the rising edge until the data are taken"),
        Port("follow_clock", BIT, doc="1: the modulators bring their clock"),
    ),
    outputs=(
        Port("mod_clock", BIT, doc="clock for the modulators"),
        Port("bits", Format(0, 3, 0), doc="a bit of each modulator"),
        Port("bits_valid", BIT, doc="1 for a clock: the bits are new"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"STROBES": STROBES},
    configs=({"LINES": 3}, {"LINES": 1}),
    width_from={name: lambda config: Format(0, config["LINES"], 0) for name in ("mod_data", "bits")},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
