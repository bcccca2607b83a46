# SPDX-License-Identifier: BSD-3-Clause
"""Master for an absolute encoder with EnDat 2.1 or 2.2: mode command, start bit, errors, word, CRC, position code.

``start`` begins a frame.  ``serial_clock`` falls; the encoder latches its position.  For two periods and the six of
``mode_command`` (highest bit first, it changes with the falling edge) this side drives the line (``data_drive``), then
it lets go.  From a period later on the line must be low and then rise: the start bit.  Bits are taken in their middle,
counted from that rise: so the line may be late by any time.  After the start bit come error 1 (1 when active), with
``two_errors`` = 1 error 2 (0 when active), the word with the lowest bit first and five bits of CRC, x^5 + x^3 + x + 1
from all ones over errors and word, inverted.  Command 000111 has one error bit, 111000 (EnDat 2.2) two.
The lowest ``turn_bits`` of the ``word_bits`` are the place within a turn and become the code, left-aligned or cut.

``frame_error`` comes instead of ``code_valid`` if the start bit has not come ``start_max`` clocks after the line was
let go, if it is not 1 in its middle, if the CRC is wrong (``crc_on`` = 1), if the encoder says error, or if turn_bits
is 0 or above word_bits.  A wrong bit from the errors to the CRC is noticed by these; a start bit taken for 0 by
``start_max``, if that is less than a period above the encoder's time.
A start during a frame is ignored.  ``alarm`` is that of the last frame with a right CRC.
Half a period of the serial clock takes ``half_period`` + 1 clocks.
Formats: code of POSITION_BITS.  Rounding: bits below the code are cut; the angle's error is below one step of the code.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders.biss_master import START_MAX, any_settings, late_answers
from golden_model.encoders.ssi_master import BITS, HALF_PERIOD
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io.position import code_format
from golden_model.kernel import kernel

COMMAND_BITS = Format(0, 6, 0)
IDLE, COMMAND, RELEASED, BEGIN, TAKE, STOP = range(6)
FIRST, LET_GO, LISTEN = 2, 8, 9  # periods: the command begins, the line is let go, the start bit may come
CRC_BITS, CRC_POLY, CRC_FIRST = 5, 0x0B, 0x1F  # x^5 + x^3 + x + 1 without its highest bit; all ones


class State(NamedTuple):
    sync_1: int = 0
    sync_2: int = 0
    mode: int = IDLE
    serial_clock: int = 1
    wait: int = 0  # clocks to the end of this half period
    period: int = 0  # of the command
    command: int = 0  # bits still to be sent
    data_out: int = 0
    data_drive: int = 0
    age: int = 0  # clocks since the line was let go for a period
    gap: int = 0  # clocks to the middle of the next bit
    slot: int = 0  # the bit that comes next, 0 is the start bit
    fault: int = 0  # the start bit was wrong
    error: int = 0  # the encoder says error
    crc: int = 0
    work: int = 0
    code: int = 0
    code_valid: int = 0
    frame_error: int = 0
    alarm: int = 0


@kernel
def crc_step(crc, bit):
    """One more bit in the CRC."""
    feed = (crc >> (CRC_BITS - 1)) ^ bit
    return ((crc << 1) & ((1 << CRC_BITS) - 1)) ^ (CRC_POLY if feed else 0)


@kernel
def step(
    state,
    serial_data,
    start,
    half_period,
    mode_command,
    two_errors,
    word_bits,
    turn_bits,
    crc_on,
    start_max,
    position_bits,
):
    s = state
    bit = s.sync_2
    good = 0 < turn_bits <= word_bits
    mode, serial_clock, wait, period = s.mode, s.serial_clock, s.wait, s.period
    age, gap, slot = s.age, s.gap, s.slot
    command, data_out, data_drive = s.command, s.data_out, s.data_drive
    fault, error, crc, work = s.fault, s.error, s.crc, s.work
    code, code_valid, frame_error, alarm = s.code, 0, 0, s.alarm

    # The serial clock; it ends high after a whole half period
    falls = False
    if s.mode != IDLE:
        wait = half_period if s.wait == 0 else s.wait - 1
        if s.wait == 0:
            serial_clock = 1 if s.mode == STOP else 1 - s.serial_clock
            falls = s.serial_clock == 1
            if s.mode == STOP and s.serial_clock:
                mode = IDLE

    first = 1 + two_errors  # slot of the last error bit
    if s.mode == IDLE:
        wait, period, command, data_out = half_period, 0, mode_command, 0
        age, slot, fault, error, crc, work = 0, 0, 0, 0, CRC_FIRST, 0
        if start:
            mode = COMMAND if good else IDLE
            serial_clock = 0 if good else 1
            data_drive = 1 if good else 0
            frame_error = 0 if good else 1
    elif s.mode == COMMAND:
        if falls:
            period = s.period + 1
            if FIRST <= period < LET_GO:
                data_out = s.command >> 5
                command = (s.command << 1) & 63
            elif period == LET_GO:
                data_out, data_drive = 0, 0
            elif period == LISTEN:
                mode = RELEASED
    elif s.mode == RELEASED or s.mode == BEGIN:
        age = s.age + 1
        gap = half_period
        if s.age >= start_max:
            mode, frame_error = STOP, 1
        elif s.mode == RELEASED and not bit:
            mode = BEGIN
        elif s.mode == BEGIN and bit:
            mode = TAKE
    elif s.mode == TAKE:
        gap = 2 * half_period + 1 if s.gap == 0 else s.gap - 1
        if s.gap == 0:
            slot = s.slot + 1
            if s.slot == 0:
                fault = 1 - bit
            else:
                crc = crc_step(s.crc, 1 - bit if s.slot > first + word_bits else bit)
            if s.slot == 1:
                error = bit
            elif s.slot == first:
                error = 1 if s.error or not bit else 0
            if s.slot > first and s.slot <= first + turn_bits:
                work = (bit << (position_bits - 1)) | (s.work >> 1)
            if s.slot >= first + word_bits + CRC_BITS:
                mode = STOP
                right = not s.fault and (crc == 0 or not crc_on)
                alarm = s.error if right else s.alarm
                code_valid = 1 if right and not s.error else 0
                frame_error = 1 - code_valid
                code = s.work if code_valid else s.code
    following = State(
        serial_data,
        s.sync_1,
        mode,
        serial_clock,
        wait,
        period,
        command,
        data_out,
        data_drive,
        age,
        gap,
        slot,
        fault,
        error,
        crc,
        work,
        code,
        code_valid,
        frame_error,
        alarm,
    )
    busy = 0 if mode == IDLE else 1
    return following, (serial_clock, data_out, data_drive, code, code_valid, frame_error, alarm, busy)


def crc_of(bits):
    """The five bits that follow errors and word, highest first, as they are sent: inverted."""
    crc = CRC_FIRST
    for bit in bits:
        crc = crc_step.py_func(crc, bit)
    return [1 - (crc >> k & 1) for k in reversed(range(CRC_BITS))]


def patient_stimuli(rng, config):
    """Words and turns of any length, right and wrong; answers that are late by any time."""
    return stimuli(rng, config, patient=True)


def stimuli(rng, config, patient=False):
    """Frames with every setting and delay, a wrong bit at every place, a line that stays, encoders that are late."""
    rows = []

    def frame(regs, levels, start_again=0):
        """One start; ``levels``: the line clock by clock."""
        for k, level in enumerate(levels):
            rows.append({"serial_data": level, "start": int(k == 4) | start_again, **regs})

    settings = [
        (0, 13, 13, 1, 0),
        (1, 25, 13, 1, 1),
        (3, 17, 17, 0, 0),
        (4, 37, 25, 1, 1),
        (2, 63, 63, 1, 0),
    ]
    for half, word, turn, crc_on, two in any_settings(rng, 2) if patient else settings:
        period = 2 * (half + 1)
        regs = {"half_period": half, "mode_command": 0b111000 if two else 0b000111, "two_errors": two}
        regs |= {"word_bits": word, "turn_bits": turn, "crc_on": crc_on, "start_max": 12 * period}
        length = 2 + two + word + CRC_BITS
        wrongs = (None, None, "error", "high", "low", "late", *range(0, length, 7 if word > 20 else 1))
        for wrong in (None, "error", int(rng.integers(length))) if patient else wrongs:
            errors = [int(wrong == "error"), 1][: 1 + two]
            data = [*errors, *(int(b) for b in rng.integers(2, size=word))]
            bits = [1, *data, *crc_of(data)]
            if isinstance(wrong, int):
                bits[wrong] ^= 1
            quiet = 5 + 8 * period + int(rng.integers(3 * period))
            calculating = period * (20 if wrong == "late" else 2 + int(rng.integers(4)))
            levels = [int(rng.integers(2))] * quiet + [0] * calculating + [b for b in bits for _ in range(period)]
            levels += [1] * (3 * period)
            if wrong in ("high", "low"):
                levels = [int(wrong == "high")] * (quiet + 25 * period)
            frame(regs, levels, start_again=int(wrong == "late"))
            rows.extend({"serial_data": 1, "start": 0, **regs} for _ in range(15 * period))
    if patient:
        late_answers(frame, regs | {"half_period": 0}, 0)
    bad = {"half_period": 1, "mode_command": 7, "two_errors": 0, "word_bits": 12, "turn_bits": 13, "crc_on": 1}
    frame(bad | {"start_max": 100}, [1] * 20)
    return rows


BLOCK = Block(
    name="endat_master",
    folder="encoders",
    paper="none: EnDat 2.2, bidirectional interface for position encoders",
    step=step,
    inputs=(
        Port("serial_data", BIT, doc="data line as received, asynchronous pin"),
        Port("start", BIT, doc="1: read the position"),
    ),
    registers=(
        Port("half_period", HALF_PERIOD, doc="half a period of the serial clock, clocks less one"),
        Port("mode_command", COMMAND_BITS, doc="mode command, 000111 or 111000"),
        Port("two_errors", BIT, doc="1: the frame has error 2"),
        Port("word_bits", BITS, doc="bits of the word"),
        Port("turn_bits", BITS, doc="bits of the place within a turn"),
        Port("crc_on", BIT, doc="1: check the CRC"),
        Port("start_max", START_MAX, doc="longest time to the start bit, clocks"),
    ),
    outputs=(
        Port("serial_clock", BIT, doc="clock line, idle 1"),
        Port("data_out", BIT, doc="data line as driven"),
        Port("data_drive", BIT, doc="1: drive the data line"),
        Port("code_theta", Format(0, 0, 16), doc="position code of the last good frame"),
        Port("code_valid", BIT, doc="1: a frame was good"),
        Port("frame_error", BIT, doc="1: a frame was bad or could not begin"),
        Port("alarm", BIT, doc="1: the encoder says error"),
        Port("busy", BIT, doc="1: a frame is under way"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    after_reset={"serial_clock": 1},
    constants={"FIRST": FIRST, "LET_GO": LET_GO, "LISTEN": LISTEN},
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
