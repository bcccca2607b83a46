# SPDX-License-Identifier: BSD-3-Clause
"""A table in block RAM: one word is written, one read a clock; zeros after power-up.

    word = table(read_at), as it was before this clock's write

Formats: unchanged.  A reset does not touch the words.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT

WORD = Format(0, 36, 0)


class State(NamedTuple):
    words: tuple = ()  # shorter than the table: the rest is zero


def step(state, read_at, write, write_at, write_word, address_bits, _width):
    words = state.words or (0,) * (1 << address_bits)
    word = words[read_at]
    if write:
        words = (*words[:write_at], write_word, *words[write_at + 1 :])
    return State(words), (word,)


def stimuli(rng, config):
    """Every word written and read back, at other addresses and at the same one in the same clock."""
    size, top = 1 << config["ADDRESS_BITS"], 1 << config["WIDTH"]
    rows = []
    for shift in (0, 1, size // 2):
        for k in range(2 * size):
            row = {"write": int(k < size), "write_at": k % size, "write_word": int(rng.integers(top))}
            rows.append(row | {"read_at": (k - shift) % size})
    return rows


BLOCK = Block(
    name="motor_table",
    folder="motor",
    paper="docs/hil.md: maps and tables",
    step=step,
    inputs=(Port("read_at", Format(0, 10, 0), doc="address of the word that is read"),),
    # A write may stand for many clocks: it is the same word
    registers=(
        Port("write", BIT, doc="1: write a word"),
        Port("write_at", Format(0, 10, 0), doc="its address"),
        Port("write_word", WORD, doc="the word"),
    ),
    outputs=(Port("word", WORD, doc="the word that is read"),),
    state=State(),
    latency=2,
    strobes=False,
    width_from={
        "write_at": lambda config: Format(0, config["ADDRESS_BITS"], 0),
        "read_at": lambda config: Format(0, config["ADDRESS_BITS"], 0),
        "write_word": lambda config: Format(0, config["WIDTH"], 0),
        "word": lambda config: Format(0, config["WIDTH"], 0),
    },
    configs=({"ADDRESS_BITS": 4, "WIDTH": 36}, {"ADDRESS_BITS": 3, "WIDTH": 18}),
    reference=None,
    bound=None,
    stimuli=stimuli,
)
