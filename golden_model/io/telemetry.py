# SPDX-License-Identifier: BSD-3-Clause
"""An AXI4-Stream packet for every sample: inputs of the core, its results, and the sample number.

The words of a packet (telemetry_words) are read from the core's live values, delayed by one clock: one word per clock,
from TELEMETRY_WORDS_START clocks after the sample on, into a queue (packet_fifo) that the sink empties at its rate.

* The controller never waits.  If the packet of a sample does not fit into the queue, it is dropped: ``dropped`` counts
  it, up to 2**DROPPED_W - 1, and the reader sees a gap in the sample numbers, which count from 0 after a reset, modulo
  2**NUMBER_W.  These widths, 16 and 32 on a chip, are generics so that a bench can fill the counters.
* ``enable`` is checked before the first word: a packet that has begun is completed.
* The words also leave before the queue, for telemetry_ring, with which a packet is made where the queue takes none.
* As in the core, a sample less than SAMPLE_INTERVAL clocks after the last one is ignored and not counted.

Formats: unchanged, see telemetry_words.
"""

from typing import NamedTuple

from golden_model import fluxproof
from golden_model.block import Block, Port
from golden_model.common import packet_fifo
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io import sample_latch, telemetry_words
from golden_model.io.telemetry_words import COUNT, FIELDS, INPUTS, PORTS, START, WORD

INTERVAL = fluxproof.SAMPLE_INTERVAL
DROPPED = Format(0, 16, 0)
SHOWN = tuple(name for name in fluxproof.Observed._fields if name in FIELDS)


class State(NamedTuple):
    age: int = INTERVAL  # clocks since the sample, up to INTERVAL
    counter: int = WORD.hi  # number of the sample
    active: int = 0
    index: int = 0
    dropped: int = 0
    sample: tuple = (0,) * len(INPUTS)
    shown: tuple = (0,) * len(SHOWN)  # the core's values of the previous clock
    valid_1: int = 0
    word_1: int = 0
    last_1: int = 0
    valid_2: int = 0
    word_2: int = 0
    last_2: int = 0
    queued: int = 0  # the queue takes the packet
    queue: packet_fifo.State = packet_fifo.State()


def step(state, enable, sample_valid, m_axis_tready, ring_recording, *values):
    """One clock; ``values``: the raw sample, the core's values in the order of SHOWN, then the generics."""
    s, (depth_bits, number_w, dropped_w) = state, values[-3:]
    raw, shown = values[: len(INPUTS)], values[len(INPUTS) : len(INPUTS) + len(SHOWN)]

    taken = sample_valid and s.age == INTERVAL
    sample = sample_latch.step.py_func(sample_latch.Inputs(*raw)) if taken else s.sample
    age = 1 if taken else min(s.age + 1, INTERVAL)
    counter = (s.counter + 1) & ((1 << number_w) - 1) if taken else s.counter

    active, index, dropped = s.active, s.index, s.dropped
    if s.active:
        index = s.index + 1
        active = 0 if s.index == COUNT - 1 else 1
    queued = s.queued
    if s.age == START - 1:
        queued = 1 if enable and packet_fifo.room(s.queue, depth_bits, COUNT) else 0
        if queued or ring_recording:
            active, index = 1, 0
        if enable and not queued:
            dropped = min(s.dropped + 1, (1 << dropped_w) - 1)

    word_1, last_1, word_2, last_2 = s.word_1, s.last_1, s.word_2, s.last_2
    if s.active:
        fields = {**dict(zip(INPUTS, s.sample, strict=True)), **dict(zip(SHOWN, s.shown, strict=True))}
        (word_1,) = telemetry_words.step(s.index, s.counter, *(fields[name] for name in FIELDS))
        last_1 = 1 if s.index == COUNT - 1 else 0
    if s.valid_1:
        word_2, last_2 = s.word_1, s.last_1
    queue, (tvalid, tdata, tlast, _) = packet_fifo.step(
        s.queue, s.valid_2 & s.queued, s.word_2, s.last_2, m_axis_tready, WORD.width, depth_bits, COUNT
    )
    following = State(
        age, counter, active, index, dropped, sample, tuple(shown),
        s.active, word_1, last_1, s.valid_1, word_2, last_2, queued, queue,
    )  # fmt: skip
    return following, (tdata, tvalid, tlast, dropped, s.valid_1, word_2)


def stimuli(rng, config):
    """Samples at the shortest distance and too early ones, every value changing at every clock; a slow sink, a fast
    sink, a stalled sink; switched off and on."""
    ports = BLOCK.ports(config)
    rows, wait = [], 0
    for clock in range(6000):
        stalled = 1500 < clock < 3000
        ready = int(rng.integers(4) > 0) if clock < 1500 else int(not stalled and rng.integers(8) > clock // 1000)
        early = rng.integers(200) == 0
        row = {p.name: int(rng.integers(p.low, p.high + 1)) for p in ports}
        row |= {"m_axis_tready": ready, "sample_valid": int(wait == 0 or early), "enable": 1}
        if 4000 < clock < 4700:
            row["enable"] = int(rng.integers(2))
        row["ring_recording"] = int(rng.integers(2)) if clock % 1000 > 700 else 0
        wait = INTERVAL - 1 if wait == 0 else wait - 1
        if wait == 0 and rng.integers(5) == 0:
            wait = int(rng.integers(1, 40))
        rows.append(row)
    return rows


def patient_stimuli(rng, config):
    """A sink that stalls until the count of lost packets and the samples' number are full."""
    ports = BLOCK.ports(config)
    row = {p.name: int(rng.integers(p.low, p.high + 1)) for p in ports} | {"m_axis_tready": 0, "enable": 1}
    row["ring_recording"] = 0
    rows = [row | {"sample_valid": 1}] + [row | {"sample_valid": 0}] * (INTERVAL - 1)
    return rows * 300 + [row | {"m_axis_tready": 1}] * 400


_RAW = {p.name: p for p in sample_latch.BLOCK.inputs}
BLOCK = Block(
    name="telemetry",
    folder="io",
    paper="none: recording of samples",
    step=step,
    inputs=(
        Port("enable", BIT, doc="1: send packets"),
        Port("sample_valid", BIT, doc="1: the raw sample below is valid"),
        Port("m_axis_tready", BIT, doc="1: the sink accepts the word"),
        Port("ring_recording", BIT, doc="1: the ring takes the packet, whatever the queue does"),
        *(Port("running" if name == "run_in" else name, p.fmt, doc=p.doc) for name, p in _RAW.items()),
        *(PORTS[name] for name in SHOWN),
    ),
    outputs=(
        Port("m_axis_tdata", WORD, doc="a word of the packet"),
        Port("m_axis_tvalid", BIT, doc="1: the word is valid"),
        Port("m_axis_tlast", BIT, doc="1: last word of the packet"),
        Port("dropped", DROPPED, doc="samples without a packet because the queue was full"),
        Port("row_valid", BIT, doc="1: a word of a packet before the queue"),
        Port("row_word", WORD, doc="the word"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    shown_with={"m_axis_tdata": "m_axis_tvalid", "m_axis_tlast": "m_axis_tvalid", "row_word": "row_valid"},
    constants={"AGE_W": INTERVAL.bit_length()},
    configs=(
        {"ADC_BITS": 16, "POSITION_BITS": 16, "DEPTH_BITS": 6, "NUMBER_W": WORD.width, "DROPPED_W": DROPPED.width},
        {"ADC_BITS": 12, "POSITION_BITS": 18, "DEPTH_BITS": 5, "NUMBER_W": 7, "DROPPED_W": 5},
    ),
    too_wide=(0,),
    width_from={name: size for name, out in sample_latch.NAMES.items() if (size := sample_latch.sized(out))},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
