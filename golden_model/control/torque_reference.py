# SPDX-License-Identifier: BSD-3-Clause
"""From torque to current references at the least current, above base speed too, by a table of the motor.

    torque_now moves to torque_ref by torque_step in a sample at most; zero with ``run`` = 0
    r      = share*u_max*k_flux/|omega_me|                      flux limit, 1 is the flux of the table's last row
    top    = TOP(r)                                             largest torque at this flux limit
    t      = torque_gain*|torque_now|/top                       limited to 1
    i_d, i_q = table(r, t)                                      bilinear; i_q with the sign of torque_now
    torque_max = (2 - torque_gain)*top                          limit of the speed regulator, in torque mode as well
    share += k_voltage*((u_share*u_max)**2 - u_d**2 - u_q**2)   within share_min..1: the slow voltage loop
    torque_gain += k_torque*(torque_now - torque)*torque_now    within 1/2..3/2, where |omega_me| >= omega_learn and
                                                                u_d**2 + u_q**2 <= 3/4*(u_share*u_max)**2

The table is computed offline (golden_model/torque_table.py): maximum torque per ampere, current circle, voltage circle
and maximum torque per volt are in it, for any machine.  ROWS flux limits, COLUMNS torques each; the word behind a row's
columns holds TOP.  A point between four points of a disc is in that disc, so references stay in the current circle of
the table; current_limit keeps them in that of ``i_max`` whatever the table holds.  Where map and machine differ the
voltage loop takes flux away, and torque_gain corrects the torque with the estimated flux linkage: least mean squares,
so that nothing is learnt at zero torque and the sign of a torque never changes.  It is held near the voltage circle,
where the minimum pulse keeps legs from switching: their dead time is compensated without being lost, and the estimate
is up to 7 % off (docs/speed_range.md).  ``run`` = 0: share is 1, no learning.
Everything acts on the next sample but one (see current_reference).

Formats: share U(0,28), torque_gain U(1,28); r and t U(0,16), of which the interpolation uses COLUMN_BITS; i_d, i_q,
TOP PU.  Quotients, products and interpolations are floored; the increments of share and torque_gain are rounded half
up, the errors saturated to PU.  i_q and TOP below zero, which no table of a motor holds, are zero.
"""

import math
from collections import namedtuple
from typing import NamedTuple

import numpy as np

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, round_half_up, saturate
from golden_model.formats import BIT, KI, KP, PU, PU_W, U_MAX
from golden_model.kernel import kernel

ROWS, COLUMNS, WORDS = 64, 31, 32  # the word behind the columns is TOP
SIZE = ROWS * WORDS
COLUMN_BITS = 10  # fraction between two points
SHARE = Format(0, 0, 28)
TORQUE_GAIN = Format(0, 1, 28)
ONE = 1 << TORQUE_GAIN.frac_bits
RATIO_BITS = 16
RATIO_MAX = (1 << RATIO_BITS) - 1
PU_BITS, PU_HI, PU_TWO = PU.frac_bits, PU.hi, 2 << PU.frac_bits
SHARE_HI = SHARE.hi
DROP_GAIN = TORQUE_GAIN.frac_bits - PU.frac_bits
DROP_SHARE = SHARE.frac_bits - RATIO_BITS
REACH_BITS = 17  # fraction of share*u_max
DROP_REACH = REACH_BITS + KP.frac_bits - PU.frac_bits
DROP_E = 2 * PU.frac_bits - PU.frac_bits
DROP_STEP = PU.frac_bits + KI.frac_bits - SHARE.frac_bits
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
    for row in (7, 20, 21, 40):  # words that no motor's table has: any number must do
        words[:, row * WORDS : (row + 1) * WORDS] = rng.integers(PU.lo, PU.hi + 1, (2, WORDS))
    return words


EXAMPLE = _example()
BLANK = np.zeros((2, SIZE), np.int64)


class State(NamedTuple):
    share: int = SHARE.hi
    torque_gain: int = ONE
    torque_now: int = 0  # PU


@kernel
def between(low, high, fraction):
    """low + fraction*(high - low), the product floored; fraction U(0,COLUMN_BITS)."""
    return low + (((high - low) * fraction) >> COLUMN_BITS)


@kernel
def ratio(dividend, divisor):
    """dividend/divisor as U(0,16), floored; its largest value from 1 on and for a divisor of zero."""
    if dividend >= divisor:
        return RATIO_MAX
    return (dividend << RATIO_BITS) // divisor


@kernel
def step_table(state, inputs, regs, table):
    """One sample with ``table`` (2, SIZE): (next state, outputs)."""
    x, r = inputs, regs
    torque_now = clamp(x.torque_ref, state.torque_now - r.torque_step, state.torque_now + r.torque_step)
    if not x.run:
        torque_now = 0
    speed = abs(x.omega_me)
    gain = state.torque_gain >> DROP_GAIN
    reach = ((state.share >> DROP_SHARE) * x.u_max) >> (2 * RATIO_BITS - REACH_BITS)
    flux = ratio((reach * r.k_flux) >> DROP_REACH, speed)
    row_at = (flux << 6) - flux  # times ROWS - 1
    row, down = row_at >> RATIO_BITS, (row_at >> (RATIO_BITS - COLUMN_BITS)) & ((1 << COLUMN_BITS) - 1)
    base = row * WORDS
    top = max(0, between(table[0, base + COLUMNS], table[0, base + WORDS + COLUMNS], down))
    asked = (abs(torque_now) * gain) >> PU_BITS
    limited = asked >= top
    t = ratio(asked, top)
    column_at = (t << 5) - (t << 1)  # times COLUMNS - 1
    column, along = column_at >> RATIO_BITS, (column_at >> (RATIO_BITS - COLUMN_BITS)) & ((1 << COLUMN_BITS) - 1)
    at = base + column
    i_d = between(
        between(table[0, at], table[0, at + 1], along),
        between(table[0, at + WORDS], table[0, at + WORDS + 1], along),
        down,
    )
    i_q = between(
        between(table[1, at], table[1, at + 1], along),
        between(table[1, at + WORDS], table[1, at + WORDS + 1], along),
        down,
    )
    i_q = max(0, i_q)
    if torque_now < 0:
        i_q = -i_q
    torque_max = min(((PU_TWO - gain) * top) >> PU_BITS, PU_HI)

    radius = (r.u_share * x.u_max) >> RATIO_BITS
    spare = (radius * radius) >> (DROP_E + 2)
    left = saturate((radius * radius - x.u_d * x.u_d - x.u_q * x.u_q) >> DROP_E, PU_W)
    share = clamp(state.share + round_half_up(r.k_voltage * left, DROP_STEP), r.share_min << DROP_SHARE, SHARE_HI)
    error = saturate(torque_now - x.torque, PU_W)
    pull = saturate((error * torque_now) >> PU_BITS, PU_W)
    torque_gain = state.torque_gain
    if x.run and not limited and speed >= r.omega_learn and left >= spare:
        torque_gain = clamp(torque_gain + round_half_up(r.k_torque * pull, DROP_STEP), ONE // 2, ONE // 2 * 3)
    if not x.run:
        share = SHARE_HI
    return State(share, torque_gain, torque_now), (i_d, i_q, torque_max)


@kernel
def step(state, inputs, regs, example):
    """With the table that the RAM holds at power-up, the example or zeros."""
    return step_table(state, inputs, regs, EXAMPLE if example else BLANK)


def _point(v, state):
    """(row, top, column, torque) of a sample in real numbers, within the example."""
    now = state.torque_now * PU.lsb
    torque = min(max(v["torque_ref"], now - v["torque_step"]), now + v["torque_step"]) if v["run"] else 0.0
    share = (state.share >> DROP_SHARE) * 2.0**-RATIO_BITS
    speed, reach = abs(v["omega_me"]), share * v["u_max"] * v["k_flux"]
    row = (ROWS - 1) * (1.0 if reach >= speed else reach / speed)
    top = max(0.0, v["EXAMPLE"] * _across(0, row, COLUMNS))
    asked = abs(torque) * (state.torque_gain >> DROP_GAIN) * PU.lsb
    return row, top, (COLUMNS - 1) * (1.0 if asked >= top else asked / top), torque


def _across(axis, row, column):
    """The example at a row between its rows, in one column."""
    k = min(int(row), ROWS - 2)
    low, high = (float(EXAMPLE[axis, (k + n) * WORDS + column]) * PU.lsb for n in (0, 1))
    return low + (row - k) * (high - low)


def reference(v, state):
    row, top, column, torque = _point(v, state)
    k = min(int(column), COLUMNS - 2)
    i_d, i_q = (
        v["EXAMPLE"] * ((k + 1 - column) * _across(axis, row, k) + (column - k) * _across(axis, row, k + 1))
        for axis in (0, 1)
    )
    gain = (state.torque_gain >> DROP_GAIN) * PU.lsb
    i_q = max(0.0, i_q) * (-1.0 if torque < 0.0 else 1.0)
    return {"i_d_table": i_d, "i_q_table": i_q, "torque_max": min((2.0 - gain) * top, PU.hi * PU.lsb)}


def bound(v, state):
    """Floors of reach, dividends and both fractions, times the steepest step of the example."""
    fraction = 2.0**-COLUMN_BITS
    speed = max(abs(v["omega_me"]), PU.lsb)
    flux = (2.0**-REACH_BITS * v["k_flux"] + 2.0 * PU.lsb) / speed + 2.0**-RATIO_BITS
    rows = min((ROWS - 1) * flux + fraction, float(ROWS))
    example = EXAMPLE.reshape(2, ROWS, WORDS) * PU.lsb
    down, along = (float(np.abs(np.diff(example, axis=axis)).max()) for axis in (1, 2))
    top = rows * float(np.abs(np.diff(example[0, :, COLUMNS])).max()) + 2.0 * PU.lsb
    real = max(_point(v, state)[1] - top, PU.lsb)
    columns = min((COLUMNS - 1) * ((PU.lsb + top) / real + 2.0**-RATIO_BITS) + fraction, float(COLUMNS))
    current = rows * down + columns * along + 4.0 * PU.lsb
    return {"i_d_table": current, "i_q_table": current, "torque_max": 1.5 * top + 2.0 * PU.lsb}


def possible(row, _config):
    """No write into the table: its content is a parameter of the model."""
    return row | {"table_word": row["table_word"] & (WRITE - 1)}


def stimuli(rng, _config):
    """Every row and column and both edges of each, limits of torque, flux and state, zero speed, learning and stop."""
    calm = {"u_max": 37000, "u_d": -9000, "u_q": 30000, "run": 1, "k_flux": 3 << 16, "u_share": 64000}
    calm |= {"k_voltage": 900, "k_torque": 5000, "share_min": 20000, "omega_learn": 9000, "torque": 12000}
    calm |= {"torque_step": PU.hi}
    rows = []
    for k in range(150):
        speed = int(37000 * 3 / (1 + k % 75) * 1.3) + int(rng.integers(0, 40))
        rows.append({**calm, "omega_me": (speed % PU.hi) * (-1) ** k, "torque_ref": int(rng.integers(-60000, 60000))})
    for k in range(120):  # a state that moves in both directions, to both ends
        push = {"u_d": 0, "u_q": 0} if k % 40 < 20 else {"u_d": 60000, "u_q": 60000}
        gains = {"k_voltage": KI.hi >> (k % 8), "k_torque": KI.hi >> (k % 8)}
        given = {"torque_ref": 40000, "torque": int(rng.choice((0, 30000, 41000, 80000)))}
        rows.append({**calm, **push, **gains, **given, "omega_me": 60000, "run": int(k % 29 > 0)})
    for omega in (0, 1, -1, 2, PU.hi, PU.lo, 8999, 9000, -9000):
        for torque_ref in (0, 1, -1, PU.hi, PU.lo, 5):
            rows.append({**calm, "omega_me": omega, "torque_ref": torque_ref})
            rows.append({**calm, "omega_me": omega, "torque_ref": torque_ref, "k_flux": 0, "k_torque": KI.hi})
            rows.append({**calm, "omega_me": omega, "torque_ref": torque_ref, "u_max": 65535, "k_flux": KP.hi})
    for _ in range(200):
        wide = int(2 ** rng.uniform(1, 17))
        row = {**calm, "omega_me": int(rng.integers(-131072, 131072)), "torque_ref": int(rng.integers(-wide, wide))}
        row |= {"torque": int(rng.integers(-wide, wide)), "k_flux": int(2 ** rng.uniform(10, 21))}
        row |= {"torque_step": int(2 ** rng.uniform(0, 17))}
        rows.append(row | {"u_d": int(rng.integers(-60000, 60000)), "k_torque": int(2 ** rng.uniform(0, 24))})
    return rows


LATE = 20  # clocks after torque_ref at which the sample's voltage and torque are there
INPUTS = (
    Port("torque_ref", PU, doc="torque reference: output of the speed regulator or from the host"),
    Port("omega_me", PU, doc="electrical speed"),
    Port("u_max", U_MAX, doc="radius of the voltage circle"),
    Port("run", BIT, doc="1: the gates are switching"),
    Port("u_d", PU, late=LATE, doc="voltage, d axis"),
    Port("u_q", PU, late=LATE, doc="voltage, q axis"),
    Port("torque", PU, late=LATE, doc="estimated torque"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("k_flux", KP, doc="1 over the flux linkage of the table's last row"),
    Port("u_share", Format(0, 0, 16), doc="part of the voltage circle that the voltage loop aims at"),
    Port("k_voltage", KI, doc="gain of the voltage loop per sample"),
    Port("share_min", Format(0, 0, 16), doc="least part of the flux limit that the voltage loop leaves"),
    Port("k_torque", KI, doc="gain of the torque correction per sample"),
    Port("omega_learn", PU, lo=0, doc="the torque correction is held below this speed"),
    Port("torque_step", PU, lo=0, doc="largest change of the torque reference per sample"),
    Port("table_word", Format(0, 31, 0), doc="a word of the torque table: bits 17-0 value, 28-18 address, 29 0 for i_d"
         " and 1 for i_q, 30 write"),
)  # fmt: skip
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="torque_reference",
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
    ),
    state=State(),
    latency=42,
    interval=43,
    constants={
        "ROWS": ROWS,
        "WORDS": WORDS,
        "COLUMN_BITS": COLUMN_BITS,
        "DROP_E": DROP_E,
        "DROP_REACH": DROP_REACH,
        "DROP_STEP": DROP_STEP,
        "REACH_BITS": REACH_BITS,
    },  # fmt: skip
    roms={"EXAMPLE_D": (PU, [int(v) for v in EXAMPLE[0]]), "EXAMPLE_Q": (PU, [int(v) for v in EXAMPLE[1]])},
    configs=({"EXAMPLE": 1}, {"EXAMPLE": 0}),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    possible=possible,
)
