# SPDX-License-Identifier: BSD-3-Clause
"""Master for SPI converters: spi_frame clocks the frame, spi_words makes codes of its bits; one step is one clock.

Each ``sample_trigger`` is answered by ``codes_valid`` with all codes, or by ``frame_error``.  See spi_frame for the
start of the conversion, the edges, the time-out and refused settings, spi_words for the place and the sign of a code.
The bit taken is the level of the pin ``sample_delay`` clocks after the edge of ``sclk`` has left its register,
registered twice; ``sample_delay`` covers the round trip (output pad, isolator, converter, input pad), so that the
line is stable then.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.converters import spi_frame, spi_words
from golden_model.formats import BIT
from golden_model.kernel import kernel


class State(NamedTuple):
    of_spi_frame: spi_frame.State = spi_frame.State()
    of_spi_words: spi_words.State = spi_words.State()
    frame_start: int = 0
    bit_taken: int = 0
    codes_valid: int = 0


@kernel
def step(state, inputs, regs, adc_bits, lines):
    x, r = inputs, regs
    s = state
    frame, (convst, cs_n, sclk, frame_start, bit_taken, frame_error, setting_refused) = spi_frame.step(
        s.of_spi_frame,
        spi_frame.Inputs(sample_trigger=x.sample_trigger, busy=x.busy, words_complete=s.codes_valid),
        r,
        adc_bits,
    )
    words, (codes_valid, code_0, code_1, code_2, code_3, code_4, code_5, code_6, code_7) = spi_words.step(
        s.of_spi_words,
        s.frame_start,
        s.bit_taken,
        x.miso,
        r.word_bits,
        r.skip_bits,
        r.two_words,
        r.signed_code,
        adc_bits,
        lines,
    )
    following = State(frame, words, frame_start, bit_taken, codes_valid)
    outputs = (
        convst, cs_n, sclk, codes_valid, frame_error, setting_refused,
        code_0, code_1, code_2, code_3, code_4, code_5, code_6, code_7,
    )  # fmt: skip
    return following, outputs


def stimuli(rng, config):
    """The frames of spi_frame, with noise on the lines."""
    return _on_lines(spi_frame.stimuli(rng, config), rng, config)


def patient_stimuli(rng, config):
    """The longer times of convst, as far as a bench of the whole has the time."""
    return _on_lines(spi_frame.long_times(10), rng, config)


def _on_lines(rows, rng, config):
    """Rows of spi_frame as rows of the converter, with noise on the lines."""
    top = (1 << config["LINES"]) - 1
    rows = [dict(row) for row in rows]
    for number, row in enumerate(rows):
        del row["words_complete"]
        row |= {"miso": int(rng.integers(top + 1)), "signed_code": number >> 10 & 1}
    return rows


INPUTS = (spi_frame.BLOCK.inputs[0], spi_words.MISO, spi_frame.BLOCK.inputs[1])
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = spi_frame.BLOCK.registers + spi_words.REGISTERS[-1:]
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="spi_converter",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        *spi_frame.BLOCK.outputs[:3],
        Port("codes_valid", BIT, doc="1 for a clock: the codes are new"),
        *spi_frame.BLOCK.outputs[-2:],
        *spi_words.CODES,
    ),
    state=State(),
    latency=1,
    clocked=True,
    after_reset={"cs_n": 1},
    configs=spi_words.BLOCK.configs,
    width_from=spi_words.WIDTHS,
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
