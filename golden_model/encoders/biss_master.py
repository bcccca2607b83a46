# SPDX-License-Identifier: BSD-3-Clause
"""Master for an absolute encoder with BiSS-C: clock, acknowledge, start bit, word, status, CRC, position code.

``start`` begins a frame: ``serial_clock`` (MA) runs until the last bit has come.  The encoder answers on SLO: low as
the acknowledge, then the start bit 1, CDS 0, the word with the highest bit first, the error bit and the warning bit
(both 0 when active) and six bits of CRC, x^6 + x + 1 over word, error and warning, inverted.  The bits are taken in
their middle, counted from the rise of the start bit: so the line may be late by any time.
The lowest ``turn_bits`` of the ``word_bits`` are the place within a turn and become the code, left-aligned or cut.

``frame_error`` comes instead of ``code_valid`` if the line is not 1 at the start (not connected, or the encoder not
ready), if the start bit has not come after ``start_max`` clocks, if it or CDS is wrong, if the CRC is wrong
(``crc_on`` = 1), if the encoder says error, or if turn_bits is 0 or above word_bits.  A wrong bit from CDS to CRC is
noticed by these; a start bit taken for 0 by ``start_max``, if that is less than a period above the encoder's time.
A start during a frame is ignored.  ``alarm`` and ``warning`` are those of the last frame with a right CRC.
Half a period of the serial clock takes ``half_period`` + 1 clocks.
Formats: code of POSITION_BITS.  Rounding: bits below the code are cut; the angle's error is below one step of the code.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders.ssi_master import BITS, HALF_PERIOD
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io.position import code_format
from golden_model.kernel import kernel

START_MAX = Format(0, 16, 0)
IDLE, ACKNOWLEDGE, BEGIN, TAKE, STOP = range(5)
CRC_BITS, CRC_POLY = 6, 0x03  # x^6 + x + 1 without its highest bit


class State(NamedTuple):
    sync_1: int = 0
    sync_2: int = 0
    mode: int = IDLE
    serial_clock: int = 1
    wait: int = 0  # clocks to the end of this half period
    age: int = 0  # clocks since the frame began
    gap: int = 0  # clocks to the middle of the next bit
    slot: int = 0  # the bit that comes next, 0 is the start bit
    fault: int = 0  # start bit or CDS were wrong
    crc: int = 0
    mark: int = 0  # bit of the code that comes next
    work: int = 0
    status: int = 0  # error and warning bits
    code: int = 0
    code_valid: int = 0
    frame_error: int = 0
    alarm: int = 0
    warning: int = 0


@kernel
def crc_step(crc, bit):
    """One more bit in the CRC."""
    feed = (crc >> (CRC_BITS - 1)) ^ bit
    return ((crc << 1) & ((1 << CRC_BITS) - 1)) ^ (CRC_POLY if feed else 0)


@kernel
def step(state, serial_data, start, half_period, word_bits, turn_bits, crc_on, start_max, position_bits):
    s = state
    bit = s.sync_2
    good = 0 < turn_bits <= word_bits
    mode, serial_clock, wait, age, gap, slot = s.mode, s.serial_clock, s.wait, s.age, s.gap, s.slot
    fault, crc, mark, work, status = s.fault, s.crc, s.mark, s.work, s.status
    code, code_valid, frame_error, alarm, warning = s.code, 0, 0, s.alarm, s.warning

    # The serial clock; it ends high after a whole half period
    if s.mode != IDLE:
        wait = half_period if s.wait == 0 else s.wait - 1
        if s.wait == 0:
            serial_clock = 1 if s.mode == STOP else 1 - s.serial_clock
            if s.mode == STOP and s.serial_clock:
                mode = IDLE

    if s.mode == IDLE:
        wait, age, slot, fault, crc, work, status = half_period, 0, 0, 0, 0, 0, 0
        mark = 1 << (position_bits - 1)
        if start:
            mode = ACKNOWLEDGE if good and bit else IDLE
            serial_clock = 1 if mode == IDLE else 0
            frame_error = 1 if mode == IDLE else 0
    elif s.mode == ACKNOWLEDGE or s.mode == BEGIN:
        age = s.age + 1
        gap = half_period
        if s.age >= start_max:
            mode, frame_error = STOP, 1
        elif s.mode == ACKNOWLEDGE and not bit:
            mode = BEGIN
        elif s.mode == BEGIN and bit:
            mode = TAKE
    elif s.mode == TAKE:
        gap = 2 * half_period + 1 if s.gap == 0 else s.gap - 1
        if s.gap == 0:
            slot = s.slot + 1
            if s.slot < 2:
                fault = 1 if s.fault or bit == s.slot else 0
            else:
                crc = crc_step(s.crc, 1 - bit if s.slot > word_bits + 3 else bit)
            if s.slot <= word_bits + 1:
                if s.slot + turn_bits > word_bits + 1 and s.slot >= 2:
                    work = s.work | (s.mark if bit else 0)
                    mark = s.mark >> 1
            elif s.slot <= word_bits + 3:
                status = ((s.status << 1) & 2) | bit
            if s.slot >= word_bits + 3 + CRC_BITS:
                mode = STOP
                right = not s.fault and (crc == 0 or not crc_on)
                if right:
                    alarm, warning = 1 - (s.status >> 1), 1 - (s.status & 1)
                code_valid = 1 if right and s.status >> 1 else 0
                frame_error = 1 - code_valid
                code = s.work if code_valid else s.code
    following = State(
        serial_data,
        s.sync_1,
        mode,
        serial_clock,
        wait,
        age,
        gap,
        slot,
        fault,
        crc,
        mark,
        work,
        status,
        code,
        code_valid,
        frame_error,
        alarm,
        warning,
    )
    return following, (serial_clock, code, code_valid, frame_error, alarm, warning, 0 if mode == IDLE else 1)


def crc_of(bits):
    """The six bits that follow word, error and warning, highest first, as they are sent: inverted."""
    crc = 0
    for bit in bits:
        crc = crc_step.py_func(crc, bit)
    return [1 - (crc >> k & 1) for k in reversed(range(CRC_BITS))]


def any_settings(rng, flags):
    """Half periods, words and turns of any length, and so many flags."""
    for number in range(60):
        word = int(rng.integers(1, BITS.hi + 1))
        turn = word if number % 3 == 0 else int(rng.integers(1, word + 1))
        half, word, turn = (int(rng.integers(2)), word, turn) if number < 57 else (1 << 2 * number - 111, 5, 3)
        yield half, word, turn, *rng.integers(2, size=flags).tolist()


def late_answers(frame, regs, line):
    """An encoder that never answers, or just too late: each bit of the longest time, and each less one.

    Above the bits that a bench can wait for, a time that must not end as early as its lower bits say.
    """
    for bit in range(START_MAX.width):
        for start_max in {1 << bit, (1 << bit) - 1, 1 << bit | 40}:
            quiet = min(start_max, 1100) + 150
            frame(regs | {"start_max": start_max}, [line] * quiet)
            frame(regs | {"start_max": START_MAX.hi}, [1 - line] * 250)


def patient_stimuli(rng, config):
    """Words and turns of any length, right and wrong; answers that are late by any time."""
    return stimuli(rng, config, patient=True)


def stimuli(rng, config, patient=False):
    """Frames with every setting and delay, a wrong bit at every place, a line that stays, encoders that are late."""
    rows = []

    def frame(regs, levels, start_again=0):
        """One start; ``levels``: the line clock by clock, 1 before and after."""
        for k, level in enumerate(levels):
            rows.append({"serial_data": level, "start": int(k == 4) | start_again, **regs})

    settings = [(0, 12, 12, 1), (1, 26, 14, 1), (3, 18, 18, 0), (4, 32, 20, 1), (2, 63, 63, 1)]
    for half, word, turn, crc_on in any_settings(rng, 1) if patient else settings:
        period = 2 * (half + 1)
        regs = {"half_period": half, "word_bits": word, "turn_bits": turn, "crc_on": crc_on, "start_max": 12 * period}
        length = 2 + word + 2 + CRC_BITS
        wrongs = (None, None, "error", "warning", "high", "low", "late", *range(0, length, 7 if word > 20 else 1))
        for wrong in (None, "error", int(rng.integers(length))) if patient else wrongs:
            data = [int(b) for b in rng.integers(2, size=word)] + [int(wrong != "error"), int(wrong != "warning")]
            bits = [1, 0, *data, *crc_of(data)]
            if isinstance(wrong, int):
                bits[wrong] ^= 1
            quiet = 8 + 2 * period + int(rng.integers(3 * period))
            acknowledge = period * (20 if wrong == "late" else 1 + int(rng.integers(3)))
            levels = [1] * quiet + [0] * acknowledge + [b for b in bits for _ in range(period)]
            levels += [0] * (3 * period) + [1] * (3 * period)
            if wrong in ("high", "low"):
                levels = [int(wrong == "high")] * (quiet + 20 * period)
            frame(regs, levels, start_again=int(wrong == "warning"))
            frame(regs, [1] * (4 * period + 10))
            frame(regs, [1] * (15 * period))
    if patient:
        late_answers(frame, regs | {"half_period": 0}, 1)
    bad = {"half_period": 1, "word_bits": 12, "turn_bits": 13, "crc_on": 1, "start_max": 100}
    frame(bad, [1] * 20)
    frame(bad | {"turn_bits": 0}, [1] * 20)
    return rows


BLOCK = Block(
    name="biss_master",
    folder="encoders",
    paper="none: BiSS interface, protocol C",
    step=step,
    inputs=(
        Port("serial_data", BIT, doc="SLO, asynchronous pin"),
        Port("start", BIT, doc="1: read the position"),
    ),
    registers=(
        Port("half_period", HALF_PERIOD, doc="half a period of the serial clock, clocks less one"),
        Port("word_bits", BITS, doc="bits of the word"),
        Port("turn_bits", BITS, doc="bits of the place within a turn"),
        Port("crc_on", BIT, doc="1: check the CRC"),
        Port("start_max", START_MAX, doc="longest time to the start bit, clocks"),
    ),
    outputs=(
        Port("serial_clock", BIT, doc="MA, idle 1"),
        Port("code_theta", Format(0, 0, 16), doc="position code of the last good frame"),
        Port("code_valid", BIT, doc="1: a frame was good"),
        Port("frame_error", BIT, doc="1: a frame was bad or could not begin"),
        Port("alarm", BIT, doc="1: the encoder says error"),
        Port("warning", BIT, doc="1: the encoder says warning"),
        Port("busy", BIT, doc="1: a frame is under way"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    after_reset={"serial_clock": 1},
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
