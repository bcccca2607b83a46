# SPDX-License-Identifier: BSD-3-Clause
"""Third-order sinc filter of a delta-sigma modulator's bits, one result for each trigger; one step is one clock.

    acc_1 += weight*bit;  acc_2 += acc_1;  acc_3 += acc_2          at every bit, each from the values before
    total = third difference of acc_3 over four instants, ``oversampling`` bits apart
    code  = total * gain * 2**(ADC_BITS - 24)                      0 to 1 is the density of ones

Window: the first instant is the first bit with ``bits_valid`` 2 + ``start_clocks`` clocks after the trigger or
later.  The result weighs this bit and the following 3*(R - 1), R being ``oversampling``, symmetrically: their middle
is 1.5*(R - 1) bits after the first.  ``start_clocks`` = one PWM period less this time puts the middle on the next
trigger, see ``centred``.

Scale without a division: ``weight`` is 1, 8, 64 or 512 for R of 129..256, 65..128, 33..64, 32, so that R**3 * weight
is above 2**21 and at most 2**24; ``gain`` is 2**24 over it, exactly 1 for a power of two.
Wrap: the accumulators wrap modulo 2**25 by design.  Their difference over the window is at most 2**24, and
differences modulo 2**25 of wrapped numbers are the same as of unwrapped ones; what was in them before the window
cancels.

``window_error``: a window ends without a result, because the next one starts before its last bit (bits are missing,
or the window is longer than the distance of the triggers), or a trigger comes while ``start_clocks`` of the last one
are counted.
Formats: code U(0,ADC_BITS); total loses its lowest bit, the product is rounded half up and saturated at all ones.
``oversampling`` from 32 to 256; a change has an effect from the next window on.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up, saturate_u, wrap
from golden_model.formats import BIT, CODE
from golden_model.io.current_conditioning import code_format
from golden_model.kernel import kernel

OVERSAMPLING = Format(0, 9, 0)
GAIN = Format(0, 3, 14)
CLOCKS = Format(0, 16, 0)
TOTAL_W = 25
FULL = 1 << (TOTAL_W - 1)
INSTANTS = 3  # after the first one
PRODUCT = TOTAL_W - 2 + GAIN.frac_bits  # fraction bits of the product


class State(NamedTuple):
    acc_1: int = 0
    acc_2: int = 0
    acc_3: int = 0
    last_1: int = 0  # of the differences, rotating: acc_3, first, second
    last_2: int = 0
    last_3: int = 0
    waiting: int = 0  # start_clocks are counted
    remaining: int = 0
    armed: int = 0  # the next bit is the first of a window
    open: int = 0
    bits_left: int = 0  # until the next instant
    instant: int = 0
    valid_1: int = 0
    valid_2: int = 0
    valid_3: int = 0
    valid_4: int = 0
    valid_5: int = 0
    total: int = 0
    prod_5: int = 0
    code: int = 0


@kernel
def weight_of(oversampling):
    """A one of the modulator, in the units of acc_1."""
    if oversampling > 128:
        return 1
    if oversampling > 64:
        return 8
    return 64 if oversampling > 32 else 512


@kernel
def step(state, sample_trigger, mod_bit, bits_valid, oversampling, gain, start_clocks, adc_bits):
    s = state
    drop = PRODUCT - adc_bits

    # Integrators
    acc_1, acc_2, acc_3 = s.acc_1, s.acc_2, s.acc_3
    if bits_valid:
        acc_1 = wrap(s.acc_1 + (weight_of(oversampling) if mod_bit else 0), TOTAL_W)
        acc_2 = wrap(s.acc_2 + s.acc_1, TOTAL_W)
        acc_3 = wrap(s.acc_3 + s.acc_2, TOTAL_W)

    # Start of the window
    starts = s.waiting and s.remaining == 0
    first = bits_valid and s.armed
    waiting, remaining, armed = s.waiting, s.remaining, s.armed
    if s.waiting and not starts:
        remaining = s.remaining - 1
    if first:
        armed = 0
    if starts:
        waiting, armed = 0, 1
    if sample_trigger:
        waiting, remaining = 1, start_clocks

    # Instants of the window
    later = bits_valid and s.open and s.bits_left == 0
    window, bits_left, instant = s.open, s.bits_left, s.instant
    if first:
        window, bits_left, instant = 1, oversampling - 1, 0
    elif later:
        window, bits_left, instant = 1 if s.instant + 1 < INSTANTS else 0, oversampling - 1, s.instant + 1
    elif bits_valid and s.open:
        bits_left = s.bits_left - 1
    cut = (first and s.open) or (starts and s.armed) or (sample_trigger and s.waiting and not starts)

    # Stages 1 to 4: total = acc_3, then three differences with the last ones
    total, last_1, last_2, last_3 = s.total, s.last_1, s.last_2, s.last_3
    if first or later:
        total = s.acc_3
    elif s.valid_1 or s.valid_2 or s.valid_3:
        total = wrap(s.total - s.last_1, TOTAL_W)
        last_1, last_2, last_3 = s.last_2, s.last_3, s.total

    # Stage 5: prod = total/2 * gain
    prod_5 = (s.total >> 1) * gain if s.valid_4 else s.prod_5

    # Stage 6: code = prod, rounded and saturated
    code = saturate_u(round_half_up(s.prod_5, drop), adc_bits) if s.valid_5 else s.code
    following = State(
        acc_1, acc_2, acc_3, last_1, last_2, last_3, waiting, remaining, armed, window, bits_left, instant,
        1 if first or later else 0, s.valid_1, s.valid_2, 1 if s.valid_3 and s.instant == INSTANTS else 0, s.valid_4,
        total, prod_5, code,
    )  # fmt: skip
    return following, (code, s.valid_5, 1 if cut else 0)


def gain_of(oversampling):
    """Register ``gain`` for an oversampling of 32 to 256."""
    return GAIN.to_int(FULL / (oversampling**3 * weight_of(oversampling)))


def centred(period_clocks: int, oversampling: int, bit_clocks: int, bit_delay: float = 0):
    """Register ``start_clocks`` that puts the window's middle on the next trigger.

    ``period_clocks``: distance of the triggers; ``bit_clocks``: of two bits; ``bit_delay``: from the middle of the
    time that a bit stands for to its ``bits_valid``, all in clocks.  Raises ValueError where the window does not fit
    the period.
    """
    clocks = round(period_clocks - 1.5 * (oversampling - 1) * bit_clocks - 2 + bit_delay - bit_clocks / 2)
    if not 0 <= clocks <= min(CLOCKS.hi, period_clocks - 1) or (3 * oversampling + 1) * bit_clocks > period_clocks:
        raise ValueError(
            f"a window of 3*{oversampling} bits of {bit_clocks} clocks does not fit {period_clocks} clocks"
        )
    return clocks


def stimuli(rng, config):
    """Every weight with random and constant bits, close and far apart; a gain too large; windows broken off."""
    rows = []
    cases = [(32, 1), (33, 0), (64, 2), (65, 3), (100, 0), (128, 1), (129, 0), (256, 0), (40, 5)]
    for number, (oversampling, gap) in enumerate(cases):
        regs = {"oversampling": oversampling, "gain": gain_of(oversampling), "start_clocks": 7 * number}
        if number == 8:
            regs["gain"] = GAIN.hi
        for window in range(4):
            density = (0.5, 1.0, 0.0, 0.8)[window]
            length = (3 * oversampling + 4) * (gap + 1) + regs["start_clocks"] + 12
            for clock in range(length if window != 3 else length // 2):
                row = {"sample_trigger": int(clock == 1), "mod_bit": int(rng.random() < density)}
                rows.append(row | {"bits_valid": int(clock % (gap + 1) == 0)} | regs)
    return rows


def patient_stimuli(rng, _config):
    """Any ratio with any gain, nearly only ones or zeros; each bit of start_clocks; triggers while they are counted."""
    rows = []

    def window(regs, density, gap, again=0):
        length = (3 * regs["oversampling"] + 4) * (gap + 1) + min(regs["start_clocks"], 5000) + 12
        bits = rng.random(length) < density
        for clock in range(length):
            row = {"sample_trigger": int(clock in (1, again)), "mod_bit": int(bits[clock])}
            rows.append(row | {"bits_valid": int(clock % (gap + 1) == 0)} | regs)

    for number in range(60):
        oversampling = (256, 255, 128, 32)[number % 4] if number < 16 else int(rng.integers(32, 257))
        gain = gain_of(oversampling) if number % 3 else int(rng.integers(GAIN.hi + 1))
        regs = {"oversampling": oversampling, "gain": gain, "start_clocks": int(rng.integers(4))}
        window(regs, (1, 0, 0.99, 0.01, 0.3)[number % 5], number % 7 == 6)
    for bit in range(CLOCKS.width):
        for start_clocks in (1 << bit, 1 << bit | 5, (1 << bit) - 1):
            regs = {"oversampling": 32, "gain": gain_of(32), "start_clocks": start_clocks}
            window(regs, 0.5, 0)
            if bit < 10:
                window(regs, 0.5, 0, again=int(rng.integers(2, start_clocks + 40)))
    return rows


BLOCK = Block(
    name="sinc3",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    inputs=(
        Port("sample_trigger", BIT, doc="1 for a clock: take a sample"),
        Port("mod_bit", BIT, doc="bit of the modulator"),
        Port("bits_valid", BIT, doc="1 for a clock: the bit is new"),
    ),
    registers=(
        Port("oversampling", OVERSAMPLING, lo=32, hi=256, doc="bits from instant to instant"),
        Port("gain", GAIN, doc="2**24 over the total of ones alone"),
        Port("start_clocks", CLOCKS, doc="clocks from the trigger to the window"),
    ),
    outputs=(
        Port("code", CODE, doc="density of ones, half scale is one half"),
        Port("code_valid", BIT, doc="1 for a clock: the code is new"),
        Port("window_error", BIT, doc="1 for a clock: a trigger remains without a code"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"TOTAL_W": TOTAL_W, "INSTANTS": INSTANTS, "PRODUCT": PRODUCT},
    configs=({"ADC_BITS": 16}, {"ADC_BITS": 14}, {"ADC_BITS": 12}),
    width_from={"code": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
