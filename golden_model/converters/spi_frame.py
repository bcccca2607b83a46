# SPDX-License-Identifier: BSD-3-Clause
"""The frame of SPI converters: start, chip select, clock, and when a bit is taken; one step is one clock.

A trigger starts a conversion and one frame; ``words_complete`` of spi_words or ``frame_error`` answers each trigger.

* ``use_convst`` = 1: ``convst`` is high until ``wait_clocks`` have passed and BUSY is low, then the frame starts.
  ``wait_clocks`` covers the delay from CONVST to BUSY and two clocks; without a BUSY pin (tied low) it is the time
  of a conversion.  No frame until ``busy_timeout``: frame_error.
  ``use_convst`` = 0: the falling edge of ``cs_n`` starts the conversion, the frame follows at once.
* Frame: ``cs_n`` low, a period of ``sclk`` later ``word_bits`` clocks (twice with ``two_words``) of ``clock_ratio``
  clocks each.
  A bit is taken at the edge of ``sclk`` in its middle: the first of the bit, or with ``second_edge`` the second.
* ``bit_taken`` comes ``sample_delay`` + 1 clocks after that edge leaves its register; ``sample_delay`` covers the
  round trip.
* The frame ends when spi_words has seen all its bits.

A frame without room for the code (``skip_bits`` + ADC_BITS > ``word_bits``), or a ratio or word length out of its
range, is refused (``setting_refused``): each trigger is a frame_error then.  So is a trigger during a frame, which
goes on, and a frame whose bits do not all arrive, because a register changed meanwhile.
BUSY is not synchronous and passes two registers.  Formats: clocks.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

RATIO = Format(0, 5, 0)
BITS = Format(0, 6, 0)
SKIP = Format(0, 5, 0)
DELAY = Format(0, 4, 0)
CLOCKS = Format(0, 16, 0)
LEAST_RATIO, MOST_RATIO = 4, 16
LEAST_BITS, MOST_BITS = 12, 32
STROBES = 16  # values of sample_delay
TRAIL = 20  # clocks after sclk until the last bit must have arrived: the longest sample_delay and the registers
IDLE, CONVERTING, LEADING, READING, TRAILING = range(5)


class State(NamedTuple):
    phase: int = IDLE
    elapsed: int = 1  # clocks that convst has been high
    tick: int = 0  # clock within a period of sclk
    sent: int = 0  # bits that sclk has clocked
    strobes: int = 0  # edges of the last clocks that take a bit, the newest at bit 0
    complete: int = 0  # spi_words has all bits
    busy_meta: int = 0
    busy_now: int = 0


@kernel
def step(state, inputs, regs, adc_bits):
    x, r = inputs, regs
    s = state
    good = LEAST_RATIO <= r.clock_ratio <= MOST_RATIO and LEAST_BITS <= r.word_bits <= MOST_BITS
    good = good and r.skip_bits + adc_bits <= r.word_bits
    half = r.clock_ratio >> 1
    bits = r.word_bits << r.two_words
    last_tick = s.tick + 1 >= r.clock_ratio
    sampling = 1 if s.phase == READING and s.tick == half else 0
    active = s.phase == READING and (s.tick < half if r.second_edge else s.tick >= half)
    bit_taken = (s.strobes >> r.sample_delay) & 1
    complete = 1 if s.complete or x.words_complete else 0

    # Conversion and frame
    phase, elapsed, tick, sent = s.phase, s.elapsed, s.tick + 1, s.sent
    strobes = ((s.strobes << 1) | sampling) & ((1 << STROBES) - 1)
    frame_start, frame_error = 0, 0
    if s.phase == IDLE:
        elapsed, tick, sent, strobes, complete = 1, 0, 0, 0, 0
        if x.sample_trigger and good:
            phase, frame_start = CONVERTING if r.use_convst else LEADING, 1
    elif s.phase == CONVERTING:
        elapsed, tick = s.elapsed + 1, 0
        if s.elapsed >= r.wait_clocks and not s.busy_now:
            phase = LEADING
        elif s.elapsed >= r.busy_timeout:
            phase, frame_error = IDLE, 1
    elif s.phase == LEADING:
        if last_tick:
            phase, tick = READING, 0
    elif s.phase == READING:
        if last_tick:
            tick, sent = 0, s.sent + 1
            if s.sent + 1 >= bits:
                phase = TRAILING
    elif complete:
        phase = IDLE
    elif s.tick >= TRAIL:
        phase, frame_error = IDLE, 1
    if x.sample_trigger and (s.phase != IDLE or not good):
        frame_error = 1

    following = State(phase, elapsed, tick, sent, strobes, complete, x.busy, s.busy_meta)
    outputs = (
        1 if phase == CONVERTING else 0,
        1 if phase == IDLE or phase == CONVERTING else 0,
        1 - r.clock_idle if active else r.clock_idle,
        frame_start,
        bit_taken,
        frame_error,
        0 if good else 1,
    )
    return following, outputs


def settings(**changes):
    """Registers of a common converter: 16 bits, CONVST and BUSY, one word a line."""
    return {
        "clock_ratio": 4, "word_bits": 16, "skip_bits": 0, "sample_delay": 3, "wait_clocks": 8, "busy_timeout": 300,
        "two_words": 0, "use_convst": 1, "clock_idle": 0, "second_edge": 0,
    } | changes  # fmt: skip


def stimuli(rng, config):
    """Every ratio, both starts, one and two words, all edges and delays; BUSY stuck; triggers too early; refusals."""
    room = 16 - config["ADC_BITS"]
    cases = [{"clock_ratio": r, "sample_delay": int(rng.integers(16)), "skip_bits": room} for r in range(3, 18)]
    cases += [
        {"two_words": w, "clock_idle": i, "second_edge": e, "use_convst": u, "word_bits": 18}
        for w in (0, 1)
        for i in (0, 1)
        for e in (0, 1)
        for u in (0, 1)
    ]
    cases += [
        {"word_bits": w, "skip_bits": int(rng.integers(24)), "two_words": w & 1} for w in (11, 12, 24, 31, 32, 33)
    ]
    cases += [{"wait_clocks": w, "busy_timeout": t} for w in (0, 1, 2, 30) for t in (0, 1, 30, 60)]
    rows = []
    for number, changes in enumerate(cases):
        regs = settings(**changes)
        stuck = number % 7 == 5
        length = 40 + regs["clock_ratio"] * (regs["word_bits"] << regs["two_words"]) + regs["wait_clocks"] + 20
        for clock in range(min(length, 1400)):
            row = {"sample_trigger": int(clock == 1 or rng.integers(300) == 0)}
            rows.append(
                row
                | {
                    "busy": int(stuck or 4 < clock < 4 + number % 30),
                    "words_complete": int(clock > length - 30 - 3 * number and rng.integers(9) == 0),
                }
                | regs
            )
    return rows


def _any_settings(rng, config):
    """Frames of any setting, the words complete or not before they end, triggers in every phase.

    In some a register changes meanwhile.
    """
    rows = []
    for _ in range(250):
        bits = int(rng.integers(max(LEAST_BITS - 1, 2), MOST_BITS + 2))
        room = max(bits - config["ADC_BITS"], 0)
        regs = {p.name: int(rng.integers(2)) for p in BLOCK.registers if p.is_bit}
        regs |= {"word_bits": bits, "clock_ratio": int(rng.integers(LEAST_RATIO, 7))}
        regs |= {"sample_delay": int(rng.integers(16))}
        regs |= {"skip_bits": int(rng.integers(room + 1)), "wait_clocks": int(rng.integers(12)), "busy_timeout": 40}
        often = int(rng.choice([2, 40, 400]))
        port = BLOCK.registers[int(rng.integers(len(BLOCK.registers)))] if rng.integers(2) else BLOCK.registers[0]
        change, at = {port.name: int(rng.integers(port.low, port.high + 1))}, int(rng.integers(4, 400))
        for clock in range(min(400, (regs["clock_ratio"] * bits << regs["two_words"]) + 60)):
            row = {"sample_trigger": int(clock == 3 or rng.integers(90) == 0), "busy": int(rng.integers(often) == 0)}
            row |= {"words_complete": int(rng.integers(often) == 0)}
            rows.append(row | regs | (change if clock >= at else {}))
    return rows


def patient_stimuli(rng, config):
    """Both times of convst as long as each of their bits makes them, or one clock less or more; any settings."""
    return long_times(CLOCKS.width) + _any_settings(rng, config)


def long_times(bits):
    """Times of convst up to so many bits at their end; above, one that must not end as early as its lower bits say."""
    rows = []
    for bit in range(CLOCKS.width):
        for low in (0, 5):
            row = settings(use_convst=1, wait_clocks=3, busy_timeout=1 << bit | low)
            row |= {"sample_trigger": 0, "busy": 1, "words_complete": 0}
            rows += [row | {"sample_trigger": 1}] + [row] * 30 + [row | {"busy": 0, "words_complete": 1}] * 90
    for bit in range(6, bits):
        for name, busy in (("wait_clocks", 0), ("busy_timeout", 1)):
            times = {"wait_clocks": 5, "busy_timeout": CLOCKS.hi, name: (1 << bit) + bit % 3 - 1}
            row = settings(**times, use_convst=1)
            row |= {"sample_trigger": 0, "busy": busy, "words_complete": 0}
            rows += [row | {"sample_trigger": 1}] + [row] * ((1 << bit) + 20)
            rows += [row | {"busy": 0}] * 40 + [row | {"busy": 0, "words_complete": 1}] * 900
    return rows


INPUTS = (
    Port("sample_trigger", BIT, doc="1 for a clock: take a sample"),
    Port("busy", BIT, doc="1: the converter converts, not synchronous"),
    Port("words_complete", BIT, doc="1 for a clock: all bits have arrived"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("clock_ratio", RATIO, doc="clocks of a period of sclk, 4 to 16"),
    Port("word_bits", BITS, doc="bits of a word, 12 to 32"),
    Port("skip_bits", SKIP, doc="bits of a word before the code"),
    Port("sample_delay", DELAY, doc="clocks from the edge of sclk until the line is taken"),
    Port("wait_clocks", CLOCKS, doc="least time of convst, clocks"),
    Port("busy_timeout", CLOCKS, doc="longest time of convst, clocks"),
    Port("two_words", BIT, doc="1: two words on each line"),
    Port("use_convst", BIT, doc="1: started by convst, 0: by cs_n"),
    Port("clock_idle", BIT, doc="level of sclk between frames"),
    Port("second_edge", BIT, doc="1: the second edge of sclk in a bit takes the line, 0: the first"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="spi_frame",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("convst", BIT, doc="rising edge: start of the conversion"),
        Port("cs_n", BIT, doc="0: a frame"),
        Port("sclk", BIT, doc="clock of the frame"),
        Port("frame_start", BIT, doc="1 for a clock: a trigger was accepted"),
        Port("bit_taken", BIT, doc="1 for a clock: the lines show a bit"),
        Port("frame_error", BIT, doc="1 for a clock: no codes for a trigger"),
        Port("setting_refused", BIT, doc="1: the registers contradict each other"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    after_reset={"cs_n": 1},
    constants={
        "LEAST_RATIO": LEAST_RATIO,
        "MOST_RATIO": MOST_RATIO,
        "LEAST_BITS": LEAST_BITS,
        "MOST_BITS": MOST_BITS,
        "STROBES": STROBES,
        "TRAIL": TRAIL,
    },
    configs=({"ADC_BITS": 16}, {"ADC_BITS": 12}),
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
