# SPDX-License-Identifier: BSD-3-Clause
"""From torque and flux limit to current references at the least current, by a table of the motor.

    top    = TOP(flux_part)                                     largest torque at this flux limit
    t      = torque_gain*|torque_now|/top                       limited to 1: ``torque_limited``
    i_d, i_q = table(flux_part, t)                              bilinear; i_q with the sign of torque_now
    torque_max = (2 - torque_gain)*top                          limit of the speed regulator, in torque mode as well

The table is computed offline (golden_model/torque_table.py): maximum torque per ampere, current circle, voltage circle
and maximum torque per volt are in it, for any machine.  ROWS flux limits, COLUMNS torques each; the word behind a row's
columns holds TOP.  A point between four points of a disc is in that disc, so references stay in the current circle of
the table; current_limit keeps them in that of ``i_max`` whatever the table holds.  They act on the next sample but one,
see current_reference.

Formats: torque_gain U(1,16); flux_part and t U(0,16), of which the interpolation uses COLUMN_BITS; i_d, i_q, TOP PU.
Rounding: products and interpolations are floored, torque_max saturates.  i_q and TOP below zero, which no table of a
motor holds, are zero.
"""

import math
from collections import namedtuple

import numpy as np

from golden_model.block import Block, Port
from golden_model.common import ratio
from golden_model.common.interpolation import between
from golden_model.common.ratio import BITS, RATIO
from golden_model.control.torque_correction import SHOWN
from golden_model.fixed import Format
from golden_model.formats import BIT, PU, PU_W
from golden_model.kernel import kernel

ROWS, COLUMNS, WORDS = 64, 31, 32  # the word behind the columns is TOP
SIZE = ROWS * WORDS
COLUMN_BITS = 10  # fraction between two points
PU_BITS, PU_HI, TWO = PU.frac_bits, PU.hi, 2 << SHOWN.frac_bits
WILD = (7, 20, 21, 40)  # rows of random words in the example
WRITE, SELECT, ADDRESS = 1 << 30, 1 << 29, 18  # bits of table_word: write; 0: i_d, 1: i_q; lowest bit of the address


def _example() -> np.ndarray:
    """A power-up table for the bench, of a machine with a reluctance torque: (2, SIZE) int64."""
    words = np.zeros((2, SIZE), np.int64)
    for row in range(ROWS):
        flux = (row + 0.5) / ROWS
        for column in range(COLUMNS):
            t = column / (COLUMNS - 1)
            words[0, row * WORDS + column] = -round(40000 * (0.3 * t + 0.7 * max(0.0, 1.0 - 1.4 * flux)))
            words[1, row * WORDS + column] = round(60000 * t * math.sqrt(min(1.0, flux + 0.1)))
        words[0, row * WORDS + COLUMNS] = round(50000 * min(1.0, 1.3 * flux))
    rng = np.random.default_rng(51)
    for row in WILD:  # words that no motor's table has: any number must do
        words[:, row * WORDS : (row + 1) * WORDS] = rng.integers(PU.lo, PU.hi + 1, (2, WORDS))
    return words


EXAMPLE = _example()
BLANK = np.zeros((2, SIZE), np.int64)


@kernel
def place(part, spaces):
    """(point, fraction behind it) of a part U(0,16) of so many spaces between points."""
    at = part * spaces
    return at >> BITS, (at >> (BITS - COLUMN_BITS)) & ((1 << COLUMN_BITS) - 1)


@kernel
def step_table(inputs, table):
    """One sample with ``table`` (2, SIZE): the outputs."""
    x = inputs
    row, down = place(x.flux_part, ROWS - 1)
    base = row * WORDS
    top = max(0, between(table[0, base + COLUMNS], table[0, base + WORDS + COLUMNS], down, COLUMN_BITS))
    t, torque_limited = ratio.step((abs(x.torque_now) * x.torque_gain) >> PU_BITS, top, PU_W)
    column, along = place(t, COLUMNS - 1)
    at = base + column
    i_d = between(
        between(table[0, at], table[0, at + 1], along, COLUMN_BITS),
        between(table[0, at + WORDS], table[0, at + WORDS + 1], along, COLUMN_BITS),
        down,
        COLUMN_BITS,
    )
    i_q = between(
        between(table[1, at], table[1, at + 1], along, COLUMN_BITS),
        between(table[1, at + WORDS], table[1, at + WORDS + 1], along, COLUMN_BITS),
        down,
        COLUMN_BITS,
    )
    i_q = max(0, i_q)
    if x.torque_now < 0:
        i_q = -i_q
    torque_max = min(((TWO - x.torque_gain) * top) >> PU_BITS, PU_HI)
    return i_d, i_q, torque_max, torque_limited


@kernel
def step(inputs, regs, example):  # noqa: ARG001  the table's words are a parameter of the model
    """With the table that the RAM holds at power-up, the example or zeros."""
    return step_table(inputs, EXAMPLE if example else BLANK)


def _point(v):
    """(row, top, column) of a sample in real numbers, within the example."""
    row = (ROWS - 1) * v["flux_part"]
    top = max(0.0, v["EXAMPLE"] * _across(0, row, COLUMNS))
    asked = abs(v["torque_now"]) * v["torque_gain"]
    return row, top, (COLUMNS - 1) * (1.0 if asked >= top else asked / top)


def _across(axis, row, column):
    """The example at a row between its rows, in one column."""
    k = min(int(row), ROWS - 2)
    low, high = (float(EXAMPLE[axis, (k + n) * WORDS + column]) * PU.lsb for n in (0, 1))
    return low + (row - k) * (high - low)


def reference(v, _state):
    row, top, column = _point(v)
    k = min(int(column), COLUMNS - 2)
    i_d, i_q = (
        v["EXAMPLE"] * ((k + 1 - column) * _across(axis, row, k) + (column - k) * _across(axis, row, k + 1))
        for axis in (0, 1)
    )
    i_q = max(0.0, i_q) * (-1.0 if v["torque_now"] < 0.0 else 1.0)
    return {"i_d_table": i_d, "i_q_table": i_q, "torque_max": min((2.0 - v["torque_gain"]) * top, PU.hi * PU.lsb)}


def bound(v, _state):
    """Floors of both fractions and of the ratio, times the steepest step of the example."""
    fraction = 2.0**-COLUMN_BITS
    rows = (ROWS - 1) * RATIO.lsb + fraction
    example = EXAMPLE.reshape(2, ROWS, WORDS) * PU.lsb
    down, along = (float(np.abs(np.diff(example, axis=axis)).max()) for axis in (1, 2))
    top = rows * float(np.abs(np.diff(example[0, :, COLUMNS])).max()) + 2.0 * PU.lsb
    real = max(_point(v)[1] - top, PU.lsb)
    columns = min((COLUMNS - 1) * ((PU.lsb + top) / real + RATIO.lsb) + fraction, float(COLUMNS))
    current = rows * down + columns * along + 4.0 * PU.lsb
    return {"i_d_table": current, "i_q_table": current, "torque_max": 1.5 * top + 2.0 * PU.lsb}


def possible(row, _config):
    """No write into the table: its content is a parameter of the model."""
    return row | {"table_word": row["table_word"] & (WRITE - 1)}


def stimuli(rng, _config):
    """Every row and column and both edges of each, ends of torque, flux limit and gain; wild words."""
    rows = []
    for k in range(192):
        edge = -(-(k // 3 << BITS) // (ROWS - 1)) + k % 3 - 1
        torque = int(rng.integers(-60000, 60000))
        rows.append({"flux_part": min(max(edge, 0), RATIO.hi), "torque_now": torque, "torque_gain": 1 << PU_BITS})
    for flux_part in (0, 1, RATIO.hi // 3, RATIO.hi):
        for torque in (0, 1, -1, PU.hi, PU.lo, 5, 49999, 50000, 50001):
            for gain in (1 << 15, 1 << 16, 3 << 15):
                rows.append({"flux_part": flux_part, "torque_now": torque, "torque_gain": gain})
    for k in range(240):  # between the words that no motor's table has, at both ends of the gain
        row = WILD[k % len(WILD)] - k // 4 % 2
        flux_part = int((row + rng.uniform(0, 1)) * (1 << BITS) / (ROWS - 1))
        gain = (1 << 15, 1 << 16, 3 << 15)[k // 8 % 3]
        rows.append({"flux_part": flux_part, "torque_now": int(rng.integers(-131072, 131072)), "torque_gain": gain})
    for _ in range(300):
        wide = int(2 ** rng.uniform(1, 17))
        row = {"flux_part": int(rng.integers(0, 65536)), "torque_now": int(rng.integers(-wide, wide))}
        rows.append(row | {"torque_gain": int(rng.integers(1 << 15, (3 << 15) + 1))})
    return rows


INPUTS = (
    Port("flux_part", RATIO, doc="flux limit, of the flux linkage of the table's last row"),
    Port("torque_now", PU, doc="torque reference of this sample"),
    Port("torque_gain", SHOWN, lo=1 << 15, hi=3 << 15, doc="factor of the torque reference"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("table_word", Format(0, 31, 0), doc="a word of the torque table: bits 17-0 value, 28-18 address, 29 0 for i_d"
         " and 1 for i_q, 30 write"),
)  # fmt: skip
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="reference_table",
    folder="control",
    paper="none: docs/speed_range.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("i_d_table", PU, doc="current reference of the table, d axis"),
        Port("i_q_table", PU, doc="current reference of the table, q axis"),
        Port("torque_max", PU, lo=0, doc="largest torque at this flux limit"),
        Port("torque_limited", BIT, doc="1: no more torque at this flux limit"),
    ),
    latency=28,
    interval=28,
    constants={"ROWS": ROWS, "WORDS": WORDS, "COLUMN_BITS": COLUMN_BITS},
    roms={"EXAMPLE_D": (PU, [int(v) for v in EXAMPLE[0]]), "EXAMPLE_Q": (PU, [int(v) for v in EXAMPLE[1]])},
    configs=({"EXAMPLE": 1}, {"EXAMPLE": 0}),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    possible=possible,
)
