# SPDX-License-Identifier: BSD-3-Clause
"""Master for an absolute encoder with SSI: clock burst, Gray or binary word, parity, position code.

``start`` begins a frame: the first falling edge of ``serial_clock`` latches the position in the encoder, each rising
edge puts out a bit, the highest first, and the next rising edge takes it.  The line may so be late by a period less
three clocks.
The word has ``word_bits`` bits; its lowest ``turn_bits`` are the place within a turn and become the code, left-aligned
or cut; ``gray`` = 1 decodes the whole word.  ``parity_on`` = 1 expects one more bit, which makes the ones even.

The line must be 1 before a frame and 0 for a period after its last bit, else ``frame_error`` comes instead of
``code_valid``; so it does for a wrong parity and for a ``turn_bits`` of 0 or above ``word_bits``.  Without parity SSI
cannot notice a wrong bit.  A start during a frame is ignored.
Half a period of the serial clock takes ``half_period`` + 1 clocks.
Formats: code of POSITION_BITS.  Rounding: bits below the code are cut; the angle's error is below one step of the code.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io.position import code_format
from golden_model.kernel import kernel

HALF_PERIOD = Format(0, 10, 0)
BITS = Format(0, 6, 0)


class State(NamedTuple):
    sync_1: int = 0
    sync_2: int = 0
    busy: int = 0
    serial_clock: int = 1
    wait: int = 0  # clocks to the end of this half period
    slot: int = 0  # bits put out
    stop: int = 0  # half periods since the last rising edge, plus 1
    bit: int = 0  # the last one, decoded
    odd: int = 0  # 1: an odd number of ones so far
    mark: int = 0  # bit of the code that comes next
    work: int = 0
    code: int = 0
    code_valid: int = 0
    frame_error: int = 0


@kernel
def step(state, serial_data, start, half_period, word_bits, turn_bits, gray, parity_on, position_bits):
    s = state
    good = 0 < turn_bits <= word_bits
    length = word_bits + parity_on
    busy, serial_clock, wait, slot, stop = s.busy, s.serial_clock, s.wait, s.slot, s.stop
    bit, odd, mark, work, code = s.bit, s.odd, s.mark, s.work, s.code
    code_valid, frame_error = 0, 0

    if not s.busy:
        if start:
            busy = 1 if good and s.sync_2 else 0
            frame_error = 1 - busy
            serial_clock = 1 - busy
        wait, slot, stop, bit, odd, work = half_period, 0, 0, 0, 0, 0
        mark = 1 << (position_bits - 1)
    elif s.wait != 0:
        wait = s.wait - 1
    else:
        wait = half_period
        if not s.serial_clock:
            # A rising edge takes the bit of the one before
            serial_clock = 1
            slot = s.slot + 1
            stop = 1 if s.slot >= length else 0
            if s.slot != 0:
                odd = s.odd ^ s.sync_2
                bit = s.sync_2 ^ (s.bit if gray else 0)
                if s.slot <= word_bits and s.slot + turn_bits > word_bits:
                    work = s.work | (s.mark if bit else 0)
                    mark = s.mark >> 1
        elif s.stop == 0:
            serial_clock = 0
        elif s.stop == 1:
            stop = 2
        else:
            # The line is low after the last bit
            busy = 0
            right = not s.sync_2 and not (parity_on and s.odd)
            code = s.work if right else s.code
            code_valid = 1 if right else 0
            frame_error = 0 if right else 1
    following = State(
        serial_data, s.sync_1, busy, serial_clock, wait, slot, stop, bit, odd, mark, work, code, code_valid, frame_error
    )
    return following, (serial_clock, code, code_valid, frame_error, busy)


def patient_stimuli(rng, config):
    """Words and turns of any length, right and wrong."""
    return stimuli(rng, config, patient=True)


def stimuli(rng, config, patient=False):
    """Frames of a simple encoder: every setting, wrong parity, a line that stays low or high, starts while busy."""
    rows = []
    state = State()

    def run(clocks, regs, data, start=0):
        nonlocal state
        for _ in range(clocks):
            row = {"serial_data": data(), "start": start, **regs}
            rows.append(row)
            state, _ = step(state, *row.values(), *config.values())

    settings = ((13, 13, 1, 0), (25, 12, 0, 0), (17, 17, 0, 1), (32, 20, 1, 1), (63, 30, 1, 1))
    frames = [(half, *kind) for half in (0, 1, 3) for kind in settings]
    if patient:
        frames = []
        for number in range(170):
            word = int(rng.integers(1, BITS.hi + 1))
            half = int(rng.integers(3)) if number < 160 else 1 << number - 160
            turn = word if number % 3 == 0 else int(rng.integers(1, word + 1))
            frames.append((half, word if half < 4 else 4, turn if half < 4 else 2, *rng.integers(2, size=2).tolist()))
    for half, word, turn, gray, parity in frames:
        regs = {"half_period": half, "word_bits": word, "turn_bits": turn, "gray": gray, "parity_on": parity}
        for fault in ("", "bit") if patient else ("", "", "bit", "high", "low", "busy"):
            bits = [int(b) for b in rng.integers(2, size=word)]
            bits += [sum(bits) & 1] if parity else []
            if fault == "bit":
                bits[int(rng.integers(len(bits)))] ^= 1

            def line(bits=bits, fault=fault):
                if fault in ("high", "low"):
                    return int(fault == "high")
                if not state.busy:
                    return 1
                return bits[state.slot - 1] if 0 < state.slot <= len(bits) else int(state.slot == 0)

            run(4, regs, line)
            run(1, regs, line, start=1)
            if patient and half < 3:  # a half period that changes within the frame: an odd number of clocks
                run(int(rng.integers(1, 2 * len(bits) + 1)) * (half + 1), regs, line)
                run(int(rng.integers(1, 4)), regs | {"half_period": 3}, line)
            run((2 * len(bits) + 6) * (half + 1) + 4, regs, line, start=int(fault == "busy"))
    for bad in ({"turn_bits": 0}, {"turn_bits": 14}):
        good = {"half_period": 1, "word_bits": 13, "turn_bits": 13, "gray": 0, "parity_on": 0}
        run(4, good | bad, lambda: 1, start=1)
    return rows


BLOCK = Block(
    name="ssi_master",
    folder="encoders",
    paper="none: SSI, synchronous serial interface",
    step=step,
    inputs=(
        Port("serial_data", BIT, doc="data line, asynchronous pin"),
        Port("start", BIT, doc="1: read the position"),
    ),
    registers=(
        Port("half_period", HALF_PERIOD, doc="half a period of the serial clock, clocks less one"),
        Port("word_bits", BITS, doc="bits of the word"),
        Port("turn_bits", BITS, doc="bits of the place within a turn"),
        Port("gray", BIT, doc="1: the word is in Gray code"),
        Port("parity_on", BIT, doc="1: an even parity bit follows the word"),
    ),
    outputs=(
        Port("serial_clock", BIT, doc="clock line, idle 1"),
        Port("code_theta", Format(0, 0, 16), doc="position code of the last good frame"),
        Port("code_valid", BIT, doc="1: a frame was good"),
        Port("frame_error", BIT, doc="1: a frame was bad or could not begin"),
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
