# SPDX-License-Identifier: BSD-3-Clause
"""Short third-order sinc filter of a modulator's bits for fast overcurrent alone; one step is one clock.

    acc_1 += bit;  acc_2 += acc_1;  acc_3 += acc_2         at every bit, each from the values before
    total = third difference of acc_3 over ``oversampling`` bits, every ``oversampling`` bits: 0 to oversampling**3
    over  = total >= limit_high or total <= limit_low      until the next total

It runs all the time, without a trigger.  A step of the current shows in full at the latest 4*oversampling bits and
five clocks later, one far beyond the limit earlier.  ``over`` is for the pin trip of the core, which latches it.
Wrap: the accumulators wrap modulo 2**16 by design; total is at most 2**15, and differences of wrapped numbers are
the same modulo 2**16 as of unwrapped ones.  The first three totals after a reset see less than a whole window and
never trip.
Formats: counts; nothing is rounded.  ``oversampling`` from 8 to 32, changed only while the gates are off.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, wrap
from golden_model.formats import BIT
from golden_model.kernel import kernel

OVERSAMPLING = Format(0, 6, 0)
TOTAL = Format(0, 16, 0)
TOTAL_W = TOTAL.width
WARM = 3  # totals after a reset that do not count


class State(NamedTuple):
    acc_1: int = 0
    acc_2: int = 0
    acc_3: int = 0
    last_1: int = 0  # of the differences, rotating: acc_3, first, second
    last_2: int = 0
    last_3: int = 0
    bits_left: int = 0  # until the next total
    seen: int = 0  # totals since the reset, WARM at most
    valid_1: int = 0
    valid_2: int = 0
    valid_3: int = 0
    valid_4: int = 0
    total: int = 0
    shown: int = 0
    over: int = 0


@kernel
def step(state, mod_bit, bits_valid, oversampling, limit_high, limit_low):
    s = state
    # Integrators
    acc_1, acc_2, acc_3 = s.acc_1, s.acc_2, s.acc_3
    if bits_valid:
        acc_1 = wrap(s.acc_1 + mod_bit, TOTAL_W)
        acc_2 = wrap(s.acc_2 + s.acc_1, TOTAL_W)
        acc_3 = wrap(s.acc_3 + s.acc_2, TOTAL_W)

    # Every oversampling bits
    due = bits_valid and s.bits_left == 0
    bits_left = s.bits_left
    if due:
        bits_left = oversampling - 1
    elif bits_valid:
        bits_left = s.bits_left - 1

    # Stages 1 to 4: total = acc_3, then three differences with the last ones
    total, last_1, last_2, last_3 = s.total, s.last_1, s.last_2, s.last_3
    if due:
        total = s.acc_3
    elif s.valid_1 or s.valid_2 or s.valid_3:
        total = wrap(s.total - s.last_1, TOTAL_W)
        last_1, last_2, last_3 = s.last_2, s.last_3, s.total

    # Stage 5: over = total beyond a limit
    shown, over, seen = s.shown, s.over, s.seen
    if s.valid_4:
        shown = s.total
        if s.seen == WARM:
            over = 1 if s.total >= limit_high or s.total <= limit_low else 0
        else:
            seen = s.seen + 1
    following = State(
        acc_1, acc_2, acc_3, last_1, last_2, last_3, bits_left, seen, 1 if due else 0, s.valid_1, s.valid_2,
        s.valid_3, total, shown, over,
    )  # fmt: skip
    return following, (over, shown, s.valid_4)


def stimuli(rng, _config):
    """Every oversampling, densities on both sides of the limits and at them, bits close together and far apart."""
    rows = []
    for number, oversampling in enumerate((8, 9, 16, 27, 32)):
        full = oversampling**3
        regs = {"oversampling": oversampling, "limit_high": full * 9 // 10, "limit_low": full // 10}
        for density in (0.5, 0.85, 0.92, 1.0, 0.5, 0.08, 0.0, 0.5):
            for clock in range(4 * oversampling * (1 + number % 3)):
                row = {"mod_bit": int(rng.random() < density), "bits_valid": int(clock % (1 + number % 3) == 0)}
                rows.append(row | regs)
    rows += [{"mod_bit": 1, "bits_valid": 1, "oversampling": 32, "limit_high": 1 << 15, "limit_low": 0}] * 300
    rows += [{"mod_bit": 0, "bits_valid": 1, "oversampling": 32, "limit_high": 1 << 15, "limit_low": 0}] * 300
    return rows


def patient_stimuli(_rng, _config):
    """Ones until each bit of the first integrator has counted."""
    row = {"mod_bit": 1, "bits_valid": 1, "oversampling": 32, "limit_high": 1 << 15, "limit_low": 0}
    return [row] * ((1 << TOTAL_W - 1) + 200)


BLOCK = Block(
    name="sinc_overcurrent",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    inputs=(
        Port("mod_bit", BIT, doc="bit of the modulator"),
        Port("bits_valid", BIT, doc="1 for a clock: the bit is new"),
    ),
    registers=(
        Port("oversampling", OVERSAMPLING, lo=8, hi=32, doc="bits from total to total"),
        Port("limit_high", TOTAL, doc="total that trips, and above"),
        Port("limit_low", TOTAL, doc="total that trips, and below"),
    ),
    outputs=(
        Port("over", BIT, doc="1: the last total is beyond a limit"),
        Port("total", TOTAL, doc="number of ones, weighted: 0 to oversampling**3"),
        Port("total_valid", BIT, doc="1 for a clock: the total is new"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"TOTAL_W": TOTAL_W, "WARM": WARM},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
