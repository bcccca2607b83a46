# SPDX-License-Identifier: BSD-3-Clause
"""The last rows of the telemetry in block RAM: they stay when a trip, a fault, a threshold or a write stops it.

A row is a telemetry packet, ROW_WORDS words one after the other, with two clocks or more before the next.

    ring_arm = 1:  forget the rows, record from the next whole row on; the oldest row makes room for the newest
    a trigger:     the row that is entering, or else the next one, and ring_after more are recorded; then the ring ends

A trigger is a trip or a fault that ring_faults names and that appears, a word of the row above ring_high or below
ring_low, or ring_stop.  The first one counts; ring_cause says which.  Only whole rows enter, and after the end none:
software reads them while the drive goes on, a word at ring_address after the other.

    oldest row:    address ring_next if ring_full, else 0

RING_ROWS = 0 leaves the ring out: every output is zero.
Formats: words as they come; the threshold compares the low LEVEL_W bits of a word, signed, which hold every field that
has a word for itself.  No rounding.  Latency: ring_data follows ring_address by one clock.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io.fault_latch import FLAGS
from golden_model.io.telemetry_words import COUNT, WORD

LEVEL = Format(1, 18, 0)
CAUSES = Format(0, 4, 0)
AFTER = Format(0, 12, 0)
ADDRESS = Format(0, 16, 0)
FAULTS = Format(0, FLAGS.width + 1, 0)
TRIP, FAULT, THRESHOLD, WRITE = 1, 2, 4, 8  # bits of ring_cause


class State(NamedTuple):
    ram: tuple = ()  # the words by address
    index: int = 0  # word of the row that enters
    waiting: int = 0  # armed, not between two rows yet
    live: int = 0
    hit: int = 0  # a trigger came
    ended: int = 0
    wrapped: int = 0
    full: int = 0  # wrapped, a clock later, when every word can be read
    write_at: int = 0
    left: int = 0  # rows to record beside the one that is entering
    cause: int = 0
    inside: int = 0  # a row has begun and not ended
    valid_1: int = 0
    word_1: int = 0
    final_1: int = 0
    beyond_1: int = 0  # the word is the watched one and beyond its limits
    stop_1: int = 0
    trip_1: int = 0
    trip_2: int = 0
    fault_1: int = 0
    fault_2: int = 0
    end_2: int = 0
    data: int = 0
    built: int = 0  # 1 from the first clock on


class Inputs(NamedTuple):
    """The values of a clock."""

    row_valid: int
    row_word: int
    tripped: int
    fault_flags: int
    ring_arm: int
    ring_stop: int
    ring_faults: int
    ring_word: int
    ring_high: int
    ring_low: int
    ring_after: int
    ring_address: int


def step(state, *values):
    """One clock; ``values``: those of Inputs, then the generics."""
    ring_rows, row_words = values[len(Inputs._fields) :]
    if not ring_rows:
        return state, (0,) * 7
    s, i, depth = state, Inputs(*values[: len(Inputs._fields)]), ring_rows * row_words
    now = TRIP * (s.trip_1 and not s.trip_2) + FAULT * (s.fault_1 and not s.fault_2)
    now += THRESHOLD * (s.valid_1 and s.beyond_1) + WRITE * s.stop_1

    # Recording: a word to the RAM, the first trigger, the end of the last row
    ram, write_at, wrapped = s.ram or (0,) * depth, s.write_at, s.wrapped
    data = ram[i.ring_address % (1 << (depth - 1).bit_length())] if i.ring_address < depth else 0
    hit, left, cause, live, ended, waiting = s.hit, s.left, s.cause, s.live, s.ended, s.waiting
    if s.live:
        if s.valid_1:
            ram = (*ram[:write_at], s.word_1, *ram[write_at + 1 :])
            wrapped |= int(write_at == depth - 1)
            write_at = 0 if write_at == depth - 1 else write_at + 1
        if now and not s.hit:
            hit, left, cause = 1, i.ring_after, now
        if s.end_2 and s.hit:
            left = (s.left - 1) % (AFTER.hi + 1)
            if s.left == 0:
                live, ended = 0, 1
    if s.waiting and not s.inside and not s.valid_1:
        waiting, live = 0, 1
    full = s.wrapped
    if i.ring_arm:
        waiting, live, hit, ended, wrapped, full, write_at, cause = 1, 0, 0, 0, 0, 0, 0, 0

    # Stage 1: the word, whether it is the row's last, whether it is beyond the limits
    level = i.row_word & ((1 << LEVEL.width) - 1)
    level -= (level >> (LEVEL.width - 1)) << LEVEL.width
    watched = i.ring_word != 0 and i.ring_word == s.index
    beyond_1 = int(watched and (level > i.ring_high or level < i.ring_low))
    final = s.index == row_words - 1
    index = (0 if final else s.index + 1) if i.row_valid else s.index
    inside = int(not s.final_1) if s.valid_1 else s.inside

    trip_1 = i.tripped & i.ring_faults >> FLAGS.width
    fault_1 = int(i.fault_flags & i.ring_faults & FLAGS.hi != 0)
    following = State(
        ram, index, waiting, live, hit, ended, wrapped, full, write_at, left, cause, inside,
        i.row_valid, i.row_word, int(final), beyond_1, i.ring_stop, trip_1, s.trip_1, fault_1, s.fault_1,
        int(s.valid_1 and s.final_1), data, 1,
    )  # fmt: skip
    return following, (waiting | live, ended, full, cause, write_at, data, ring_rows)


def possible(values, config):
    """An address within the ring: beyond it are words that nothing wrote."""
    return values | {"ring_address": values["ring_address"] % max(config["RING_ROWS"] * config["ROW_WORDS"], 1)}


def stimuli(rng, config):
    """Each trigger at each place of a row, before the ring is full and after; armed in a row and between two; rows with
    gaps inside; several triggers at once; nothing armed."""
    rows_, words = config["RING_ROWS"], config["ROW_WORDS"]
    depth = max(rows_ * words, 1)
    quiet = dict.fromkeys(Inputs._fields, 0) | {"ring_high": LEVEL.hi, "ring_low": LEVEL.lo}
    clocks = []
    for case in range(48):
        kind, after = case % 6, int(rng.integers(0, rows_ + 3))
        settings = quiet | {"ring_after": after}
        if kind == 0:
            settings["ring_faults"] = 1 << FLAGS.width
        elif kind == 1:
            settings["ring_faults"] = 1 << int(rng.integers(FLAGS.width))
        elif kind in (2, 3):
            settings["ring_word"] = int(rng.integers(1, words))
        begun = int(rng.integers(0, 2 * words))
        at = int(rng.integers(begun + 4, (rows_ + 3) * (words + 4)))
        clock, address = 0, 0
        for number in range(2 * rows_ + after + 4):
            word = 0
            while word < words:
                held = settings | {"ring_address": address % depth, "ring_arm": int(clock == begun)}
                held["row_valid"] = int(rng.integers(8) > 0)
                held["row_word"] = int(rng.integers(1 << 18)) * int(rng.integers(2)) + (number << 24)
                if clock >= at:
                    held |= _trigger(kind, settings, rng)
                clocks.append(held)
                word += held["row_valid"]
                clock, address = clock + 1, address + 1
            for _ in range(int(rng.integers(2, 6))):
                held = settings | {"ring_address": address % depth, "ring_arm": int(clock == begun)}
                if clock >= at:
                    held |= _trigger(kind, settings, rng)
                clocks.append(held)
                clock, address = clock + 1, address + 1
        clocks += [settings | {"ring_address": k} for k in range(depth)]
    return clocks


def _trigger(kind, settings, rng):
    """What the case changes from its moment on."""
    if kind == 0:
        return {"tripped": 1}
    if kind == 1:
        return {"fault_flags": settings["ring_faults"] | int(rng.integers(1 << FLAGS.width))}
    if kind == 2:
        return {"ring_high": int(rng.integers(0, 1 << 17))}
    if kind == 3:
        return {"ring_low": int(rng.integers(1, 1 << 17))}
    return {"ring_stop": int(rng.integers(3) == 0), "tripped": kind & 1}


BLOCK = Block(
    name="telemetry_ring",
    folder="io",
    paper="none: recording of samples",
    step=step,
    inputs=(
        Port("row_valid", BIT, doc="1: a word of a row"),
        Port("row_word", WORD, doc="the word"),
        Port("tripped", BIT, doc="1: a trip is latched"),
        Port("fault_flags", FLAGS, doc="faults since the last clear_trip"),
        Port("ring_arm", BIT, doc="1: forget the ring's rows and record"),
        Port("ring_stop", BIT, doc="1: a trigger of the ring, as a trip is"),
        Port("ring_faults", FAULTS, doc="bit x: fault x, when it appears, ends the ring; bit 16: a trip"),
        Port("ring_word", Format(0, 5, 0), doc="word of the packet that ends the ring beyond its limits; 0: none"),
        Port("ring_high", LEVEL, doc="upper limit of this word"),
        Port("ring_low", LEVEL, doc="lower limit of this word"),
        Port("ring_after", AFTER, doc="rows to record after the row of the trigger"),
        Port("ring_address", ADDRESS, doc="address of ring_data, in words"),
    ),
    outputs=(
        Port("ring_recording", BIT, doc="1: the ring records"),
        Port("ring_ended", BIT, doc="1: the ring has ended, its rows stay"),
        Port("ring_full", BIT, doc="1: every row of the ring is written"),
        Port("ring_cause", CAUSES, doc="what ended the ring: 1 trip, 2 fault, 4 threshold, 8 write"),
        Port("ring_next", ADDRESS, doc="address after the newest row: of the oldest, if ring_full"),
        Port("ring_data", WORD, doc="the ring's word at ring_address"),
        Port("ring_depth", AFTER, doc="rows of the ring as built, 0: left out"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    shown_with={"ring_data": "ring_full"},
    constants={"LEVEL_W": LEVEL.width},
    configs=({"RING_ROWS": 3, "ROW_WORDS": 5}, {"RING_ROWS": 4, "ROW_WORDS": COUNT}, {"RING_ROWS": 0, "ROW_WORDS": 5}),
    possible=possible,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
