# SPDX-License-Identifier: BSD-3-Clause
"""A FIFO in block RAM for an AXI4-Stream: accepts one word per clock, outputs one when the sink is ready.

``room`` = 1: the FIFO has space for a whole packet of PACKET words.  A writer that checks it before the first word
never waits and never breaks off a packet.  A word written to a full FIFO is ignored.  ``out_data`` and ``out_last``
stay until ``out_ready``.
Formats: unchanged.  The RAM holds 2**DEPTH_BITS words, its read register and the output register one more each.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT


class State(NamedTuple):
    ram: tuple = ()  # (word, last), oldest first
    read_valid: int = 0
    read_word: tuple = (0, 0)
    out_valid: int = 0
    out_word: tuple = (0, 0)


def room(state, depth_bits, packet):
    """1 if ``packet`` more words fit into the RAM, else 0."""
    return 1 if len(state.ram) <= (1 << depth_bits) - packet else 0


def step(state, in_valid, in_data, in_last, out_ready, _width, depth_bits, packet):
    ram, read_valid, read_word, out_valid, out_word = state
    full = len(ram) == 1 << depth_bits
    move = read_valid and (not out_valid or out_ready)
    fetch = len(ram) > 0 and (not read_valid or move)
    out_valid = 1 if move or (out_valid and not out_ready) else 0
    if move:
        out_word = read_word
    read_valid = 1 if fetch or (read_valid and not move) else 0
    if fetch:
        read_word, ram = ram[0], ram[1:]
    if in_valid and not full:
        ram = (*ram, (in_data, in_last))
    following = State(ram, read_valid, read_word, out_valid, out_word)
    return following, (out_valid, *out_word, room(following, depth_bits, packet))


def stimuli(rng, config):
    """Filled beyond full, emptied completely, both at once, at every rate of the sink."""
    rows = []
    for writes, reads in (
        (10, 0),
        (0, 10),
        (10, 10),
        (10, 2),
        (2, 10),
        (5, 5),
        (10, 9),
        (9, 10),
        (10, 0),
        (7, 10),
    ):
        for _ in range(3 << config["DEPTH_BITS"]):
            rows.append(
                {
                    "in_valid": int(rng.integers(10) < writes),
                    "in_data": int(rng.integers(1 << config["WIDTH"])),
                    "in_last": int(rng.integers(2)),
                    "out_ready": int(rng.integers(10) < reads),
                }
            )
    return rows


BLOCK = Block(
    name="packet_fifo",
    folder="common",
    paper="none: recording of samples",
    step=step,
    inputs=(
        Port("in_valid", BIT, doc="1: the input word is valid"),
        Port("in_data", Format(0, 32, 0), doc="the word"),
        Port("in_last", BIT, doc="1: last word of its packet"),
        Port("out_ready", BIT, doc="1: the sink accepts the output word"),
    ),
    outputs=(
        Port("out_valid", BIT, doc="1: the output word is valid"),
        Port("out_data", Format(0, 32, 0), doc="the oldest word"),
        Port("out_last", BIT, doc="1: last word of its packet"),
        Port("room", BIT, doc="1: the queue has space for a whole packet"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    shown_with={"out_data": "out_valid", "out_last": "out_valid"},
    after_reset={"room": 1},
    configs=({"WIDTH": 32, "DEPTH_BITS": 5, "PACKET": 24}, {"WIDTH": 9, "DEPTH_BITS": 3, "PACKET": 5}),
    width_from={
        "in_data": lambda config: Format(0, config["WIDTH"], 0),
        "out_data": lambda config: Format(0, config["WIDTH"], 0),
    },
    reference=None,
    bound=None,
    stimuli=stimuli,
)
