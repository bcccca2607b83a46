# SPDX-License-Identifier: BSD-3-Clause
"""Bits of SPI converters to codes, several data lines in parallel, one or two words on each; one step is one clock.

``bit_taken`` takes a bit of every line: the level of its pin two clocks before.  The lines are not synchronous and
pass two registers, which settle what moves at a clock at which nothing is taken; when a bit is taken they are stable
by sample_delay of spi_frame.

Code: the ADC_BITS bits after ``skip_bits`` bits of a word, most significant first.  ``signed_code``: it is two's
complement and its sign is inverted, so that zero becomes the middle of the range.  With ``two_words`` the second
word of a line is another channel.  Codes of absent lines and absent second words are zero.
All codes change together, with ``codes_valid``, after the last bit.  ``frame_start`` drops what has arrived before.
Formats: codes; nothing is computed.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.converters.spi_frame import BITS, SKIP
from golden_model.fixed import Format
from golden_model.formats import BIT, CODE
from golden_model.io.current_conditioning import code_format
from golden_model.kernel import kernel


class State(NamedTuple):
    miso_meta: int = 0
    miso_now: int = 0
    place: int = 0  # of the next bit in its word
    second: int = 0  # the second word is arriving
    complete: int = 0  # all bits have arrived
    shift_0: int = 0  # bits of the codes of a line, the second word in the lower half
    shift_1: int = 0
    shift_2: int = 0
    shift_3: int = 0
    code_0: int = 0
    code_1: int = 0
    code_2: int = 0
    code_3: int = 0
    code_4: int = 0
    code_5: int = 0
    code_6: int = 0
    code_7: int = 0


@kernel
def shifted(shift, miso, line, adc_bits):
    """The bits of a line with one more."""
    return ((shift << 1) | ((miso >> line) & 1)) & ((1 << (2 * adc_bits)) - 1)


@kernel
def offset_code(bits, signed_code, adc_bits):
    """Two's complement to a code whose middle is zero; only the lower ADC_BITS count."""
    return (bits & ((1 << adc_bits) - 1)) ^ (signed_code << (adc_bits - 1))


@kernel
def step(state, frame_start, bit_taken, miso, word_bits, skip_bits, two_words, signed_code, adc_bits, lines):
    s = state
    last_bit = s.place + 1 >= word_bits
    inside = skip_bits <= s.place < skip_bits + adc_bits

    # Bits that arrive
    place, second, complete = s.place, s.second, 0
    shift_0, shift_1, shift_2, shift_3 = s.shift_0, s.shift_1, s.shift_2, s.shift_3
    if bit_taken:
        if inside:
            shift_0 = shifted(s.shift_0, s.miso_now, 0, adc_bits)
            shift_1 = shifted(s.shift_1, s.miso_now, 1, adc_bits)
            shift_2 = shifted(s.shift_2, s.miso_now, 2, adc_bits)
            shift_3 = shifted(s.shift_3, s.miso_now, 3, adc_bits)
        place = s.place + 1
        if last_bit:
            place, second = 0, 1
            complete = 1 if s.second or not two_words else 0
    if frame_start:
        place, second = 0, 0

    # All codes together
    code_0, code_1, code_2, code_3 = s.code_0, s.code_1, s.code_2, s.code_3
    code_4, code_5, code_6, code_7 = s.code_4, s.code_5, s.code_6, s.code_7
    if s.complete:
        first = adc_bits if two_words else 0
        code_0 = offset_code(s.shift_0 >> first, signed_code, adc_bits)
        code_1 = offset_code(s.shift_1 >> first, signed_code, adc_bits) if lines > 1 else 0
        code_2 = offset_code(s.shift_2 >> first, signed_code, adc_bits) if lines > 2 else 0
        code_3 = offset_code(s.shift_3 >> first, signed_code, adc_bits) if lines > 3 else 0
        code_4 = offset_code(s.shift_0, signed_code, adc_bits) if two_words else 0
        code_5 = offset_code(s.shift_1, signed_code, adc_bits) if two_words and lines > 1 else 0
        code_6 = offset_code(s.shift_2, signed_code, adc_bits) if two_words and lines > 2 else 0
        code_7 = offset_code(s.shift_3, signed_code, adc_bits) if two_words and lines > 3 else 0
    following = State(
        miso, s.miso_meta, place, second, complete, shift_0, shift_1, shift_2, shift_3,
        code_0, code_1, code_2, code_3, code_4, code_5, code_6, code_7,
    )  # fmt: skip
    return following, (s.complete, code_0, code_1, code_2, code_3, code_4, code_5, code_6, code_7)


def stimuli(rng, config):
    """Every word length and place of the code, one and two words, both signs; frames broken off."""
    top = (1 << config["LINES"]) - 1
    rows = []
    for number in range(96):
        regs = {"word_bits": 12 + number % 21, "two_words": int(rng.integers(2)), "signed_code": number // 2 % 2}
        regs["skip_bits"] = int(rng.integers(max(regs["word_bits"] - config["ADC_BITS"], 0) + 1))
        if number > 90:
            regs["skip_bits"] = 31
        bits = regs["word_bits"] << regs["two_words"]
        for clock in range(int(rng.integers(20, 60)) if number % 9 == 8 else 2 * bits + 6):
            row = regs | {"frame_start": int(clock == 1), "bit_taken": clock & 1, "miso": int(rng.integers(top + 1))}
            rows.append(row)
    return rows


REGISTERS = (
    Port("word_bits", BITS, doc="bits of a word, 12 to 32"),
    Port("skip_bits", SKIP, doc="bits of a word before the code"),
    Port("two_words", BIT, doc="1: two words on each line"),
    Port("signed_code", BIT, doc="1: the code is two's complement"),
)
MISO = Port("miso", Format(0, 4, 0), doc="data lines of the converters, not synchronous")
CODES = tuple(Port(f"code_{k}", CODE, doc=f"line {k % 4}, word {k // 4}") for k in range(8))
WIDTHS = {"miso": lambda config: Format(0, config["LINES"], 0)} | {f"code_{k}": code_format for k in range(8)}

BLOCK = Block(
    name="spi_words",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    inputs=(
        Port("frame_start", BIT, doc="1 for a clock: a frame begins"),
        Port("bit_taken", BIT, doc="1 for a clock: the lines show a bit"),
        MISO,
    ),
    registers=REGISTERS,
    outputs=(Port("codes_valid", BIT, doc="1 for a clock: the codes are new"), *CODES),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"ADC_BITS": 16, "LINES": 3}, {"ADC_BITS": 12, "LINES": 1}, {"ADC_BITS": 14, "LINES": 4}),
    width_from=WIDTHS,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
