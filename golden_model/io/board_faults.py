# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the front ends by name, which trip the core; runs at every clock.

    0  index_wrong      the index of the encoder was off by more than correct_max counts
    1  position_lost    more than bridge_max samples without a good frame of the encoder
    2  converter_over   fast overcurrent of a delta-sigma modulator

Latched while ``enable`` is 1, so that registers can be written before; while a fault is present ``enable`` has no
effect.  ``clear_trip`` clears those whose cause is gone.  ``board_first`` contains the faults of the first clock that
tripped, until nothing trips any more.  ``board_stop`` belongs to the core's trip: its ``first_fault`` then says trip,
and this word which one.  ``board_ignore``: fault x is reported and does not trip.
Formats: bits.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

FAULTS = Format(0, 3, 0)
NAMES = ("index_wrong", "position_lost", "converter_over")


class State(NamedTuple):
    flags: int = 0
    first: int = 0
    stop: int = 0


@kernel
def step(state, index_wrong, position_lost, converter_over, enable, clear_trip, board_ignore):
    s = state
    now = index_wrong + 2 * position_lost + 4 * converter_over
    flags = (now if enable else 0) | (s.flags & now if clear_trip else s.flags)
    tripping = flags & ~board_ignore
    following = State(flags, s.first if s.stop else tripping, 1 if tripping else 0)
    f = following
    return following, (f.flags, f.first, f.stop)


def stimuli(rng, _config):
    """Each fault alone and two in sequence, cleared while present and when gone, ignored, without enable."""
    calm = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"enable": 1}
    rows = []
    for k, name in enumerate(NAMES):
        fault, other, clear = {name: 1}, {NAMES[k - 1]: 1}, {"clear_trip": 1}
        rows += [calm, calm | fault, calm, calm | other, calm | other | clear, calm | clear, calm]
        rows += [calm | fault | {"enable": 0}, calm | fault, calm | fault | clear, calm | clear | {"enable": 0}, calm]
        rows += [calm | fault | {"board_ignore": 1 << k}, calm | other | {"board_ignore": 1 << k}, calm | clear, calm]
    return rows


BLOCK = Block(
    name="board_faults",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    inputs=(
        Port("index_wrong", BIT, doc="1: an index was off by more than correct_max"),
        Port("position_lost", BIT, doc="1: more than bridge_max samples without a good frame"),
        Port("converter_over", BIT, doc="1: fast overcurrent of a modulator"),
        Port("enable", BIT, doc="1: gates may switch"),
        Port("clear_trip", BIT, doc="1: clear the flags whose cause is gone"),
    ),
    registers=(Port("board_ignore", FAULTS, doc="bit x: fault x of the board is reported and does not trip"),),
    outputs=(
        Port("board_flags", FAULTS, doc="faults of the board since the last clear_trip, see board_faults"),
        Port("board_first", FAULTS, doc="faults of the board that tripped first"),
        Port("board_stop", BIT, doc="1: gates off"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
