# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the front ends by name, which trip the core; runs at every clock.

    0  index_wrong      the index of the encoder was off by more than correct_max counts
    1  position_lost    more than bridge_max samples without a good frame of the encoder
    2  converter_over   fast overcurrent of a delta-sigma modulator
    3  no_index         the angle of an incremental encoder is unknown: its index was not seen, or not twice
    4  hall_code        a code or a change that Hall sensors cannot give, see position_front

Faults 3 and 4 are none while the position is ``forced``: the angle is then not that of the encoder.

Latched while ``enable`` is 1, so that registers can be written before; while a fault is present ``enable`` has no
effect.  ``clear_trip`` clears those whose cause is gone, where no new one came in the HELD clocks before, as in
fault_latch.  ``board_first`` contains the faults of the first clock that
tripped, until nothing trips any more.  ``board_stop`` belongs to the core's trip: its ``first_fault`` then says trip,
and this word which one.  ``core_clear`` is ``clear_trip`` a clock later, for the core: board_stop is gone by then.
``board_ignore``: fault x is reported and does not trip.
Formats: bits.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io.fault_latch import HELD
from golden_model.kernel import kernel

FAULTS = Format(0, 5, 0)
NAMES = ("index_wrong", "position_lost", "converter_over", "no_index", "hall_code")


class State(NamedTuple):
    flags: int = 0
    first: int = 0
    stop: int = 0
    clear: int = 0
    causes: int = 0  # that trip, of the last clock
    held: int = 0  # clocks for which clear_trip clears nothing


@kernel
def step(
    state, index_wrong, position_lost, converter_over, angle_unknown, hall_wrong, forced, enable, clear_trip,
    board_ignore,
):  # fmt: skip
    s = state
    now = index_wrong + 2 * position_lost + 4 * converter_over
    now += 0 if forced else 8 * angle_unknown + 16 * hall_wrong
    new = now if enable else 0
    causes = new & ~board_ignore
    caused = causes & ~s.causes != 0
    clear = clear_trip and not caused and s.held == 0
    flags = new | (s.flags & now if clear else s.flags)
    tripping = flags & ~board_ignore
    held = HELD if caused else max(s.held - 1, 0)
    following = State(flags, s.first if s.stop else tripping, 1 if tripping else 0, clear_trip, causes, held)
    f = following
    return following, (f.flags, f.first, f.stop, f.clear)


def stimuli(rng, _config):
    """Each fault alone and two in sequence, cleared while present and when gone, ignored, without enable."""
    calm = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"enable": 1}
    rows = []
    causes = [p.name for p in BLOCK.inputs[: len(NAMES)]]
    for k, name in enumerate(causes):
        fault, other, clear = {name: 1}, {causes[k - 1]: 1}, {"clear_trip": 1}
        rows += [calm | fault | {"forced": 1}, calm, calm | fault, calm | other | {"forced": 1}, *[calm] * HELD]
        rows += [calm | clear]
        later, ignore = [calm] * HELD, {"board_ignore": 1 << k}
        for wait in (0, 1, HELD - 1, HELD, HELD + 1):
            rows += [calm | fault, *[calm] * wait, calm | clear, calm, *later, calm | clear, calm]
            rows += [*[calm | fault] * (wait + 1), calm | other, calm | clear, *later, calm | clear, calm]
        rows += [calm, calm | fault, calm, calm | other, calm | other | clear, *later, calm | clear, calm]
        rows += [calm | fault | {"enable": 0}, calm | fault, calm | fault | clear, *later]
        rows += [calm | fault | clear | {"enable": 0}, calm | clear | {"enable": 0}, calm]
        rows += [calm | fault | ignore, calm | other | ignore, *later, calm | clear | ignore, calm | clear, calm]
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
        Port("angle_unknown", BIT, doc="1: the index has not been believed, and no start given"),
        Port("hall_wrong", BIT, doc="1: an illegal code of the Hall sensors, or more than one sector at once"),
        Port("forced", BIT, doc="1: the position is that of forced_position"),
        Port("enable", BIT, doc="1: gates may switch"),
        Port("clear_trip", BIT, doc="1: clear the flags whose cause is gone"),
    ),
    registers=(Port("board_ignore", FAULTS, doc="bit x: fault x of the board is reported and does not trip"),),
    outputs=(
        Port("board_flags", FAULTS, doc="faults of the board since the last clear_trip, see board_faults"),
        Port("board_first", FAULTS, doc="faults of the board that tripped first"),
        Port("board_stop", BIT, doc="1: gates off"),
        Port("core_clear", BIT, doc="clear_trip one clock later, when board_stop is gone"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
