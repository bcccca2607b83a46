# SPDX-License-Identifier: BSD-3-Clause
"""Reads channels of the XADC (or SYSMON) of a Xilinx FPGA through its DRP; one step is one clock, which is DCLK.

    trigger -> ``conversions`` times (convst, eoc) -> ``channels`` times (den with daddr, drdy with drp_do) -> codes

The XADC is set to event mode: ``convst`` holds the inputs at its rising edge.  In simultaneous sampling one
conversion holds a pair of channels; each further conversion of a frame holds its inputs later, when the one before
has ended.
``convst`` is high for CONVST_CLOCKS clocks.  A frame that has not ended ``timeout`` clocks after its trigger is a
frame_error, and so is a trigger during a frame, which goes on, and one while ``busy`` shows that a conversion of a
frame that was given up has not ended.  ``codes_valid`` or ``frame_error`` answers each trigger.
``drdy`` outside a read is ignored; a read answered after the time-out is over before
the conversion of the next frame.
``drp_do`` is left-aligned in 16 bits; the code is its upper ADC_BITS bits.  ``signed_code``: two's complement
(bipolar channel), the sign is inverted, so that zero becomes the middle of the range.  A channel that is not read
shows the code of the word 0.
All codes change together, with ``codes_valid``.  Nothing is written: dwe and di are zero.
Formats: clocks, codes; nothing is computed.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT, CODE
from golden_model.io.current_conditioning import code_format
from golden_model.kernel import kernel

ADDRESS = Format(0, 7, 0)
WORD = Format(0, 16, 0)
CLOCKS = Format(0, 16, 0)
NUMBER = Format(0, 3, 0)
CONVST_CLOCKS = 8
IDLE, CONVERTING, ASKING, READING, ENDING = range(5)


class State(NamedTuple):
    phase: int = IDLE
    elapsed: int = 1  # clocks since the trigger
    pulse: int = 0  # clocks that convst stays high
    done: int = 0  # conversions, then reads
    read_0: int = 0
    read_1: int = 0
    read_2: int = 0
    read_3: int = 0
    code_0: int = 0
    code_1: int = 0
    code_2: int = 0
    code_3: int = 0


@kernel
def offset_code(word, signed_code, adc_bits):
    """The upper bits of a word; two's complement to a code whose middle is zero."""
    return (word >> (16 - adc_bits)) ^ (signed_code << (adc_bits - 1))


@kernel
def step(state, inputs, regs, adc_bits):
    x, r = inputs, regs
    s = state
    late = s.elapsed >= r.timeout
    phase, elapsed, done = s.phase, s.elapsed + 1, s.done
    pulse = s.pulse - 1 if s.pulse > 0 else 0
    den, codes_valid, frame_error = 0, 0, 0
    read_0, read_1, read_2, read_3 = s.read_0, s.read_1, s.read_2, s.read_3
    code_0, code_1, code_2, code_3 = s.code_0, s.code_1, s.code_2, s.code_3

    if s.phase == IDLE:
        elapsed, done = 1, 0
        if x.sample_trigger and not x.busy:
            phase, pulse = CONVERTING, CONVST_CLOCKS
    elif s.phase == ENDING:
        phase, codes_valid = IDLE, 1
        code_0 = offset_code(s.read_0, r.signed_code, adc_bits)
        code_1 = offset_code(s.read_1, r.signed_code, adc_bits)
        code_2 = offset_code(s.read_2, r.signed_code, adc_bits)
        code_3 = offset_code(s.read_3, r.signed_code, adc_bits)
    elif late:
        phase, pulse, frame_error = IDLE, 0, 1
    elif s.phase == CONVERTING:
        if x.eoc and s.pulse == 0:
            done = s.done + 1
            if s.done + 1 >= r.conversions:
                phase, done = ASKING, 0
            else:
                pulse = CONVST_CLOCKS
    elif s.phase == ASKING:
        phase, den = READING, 1
    elif x.drdy:
        done, phase = s.done + 1, ENDING if s.done + 1 >= r.channels else ASKING
        read_0 = x.drp_do if s.done == 0 else s.read_0
        read_1 = x.drp_do if s.done == 1 else s.read_1
        read_2 = x.drp_do if s.done == 2 else s.read_2
        read_3 = x.drp_do if s.done == 3 else s.read_3
    if x.sample_trigger and (s.phase != IDLE or x.busy):
        frame_error = 1

    daddr = r.address_0 if s.done == 0 else r.address_1 if s.done == 1 else r.address_2 if s.done == 2 else r.address_3
    following = State(phase, elapsed, pulse, done, read_0, read_1, read_2, read_3, code_0, code_1, code_2, code_3)
    return following, (1 if pulse else 0, den, daddr, codes_valid, frame_error, code_0, code_1, code_2, code_3)


def settings(**changes):
    """Registers of a board with three currents and the bus voltage on two pairs of auxiliary inputs."""
    return {
        "conversions": 2, "channels": 4, "address_0": 0x10, "address_1": 0x18, "address_2": 0x11, "address_3": 0x19,
        "timeout": 400, "signed_code": 0,
    } | changes  # fmt: skip


def stimuli(rng, _config):
    """Every number of conversions and channels; answers early, late, never; triggers while busy."""
    rows = []
    for number in range(64):
        regs = settings(conversions=1 + number % 4, channels=1 + number // 4 % 4, signed_code=number & 1)
        regs["timeout"] = (400, 90, 9, 400, 0)[number % 5]
        often = (6, 20, 60)[number % 3]
        for clock in range(160):
            row = {"sample_trigger": int(clock == 2 or rng.integers(90) == 0), "busy": int(rng.integers(20) == 0)}
            row |= {"eoc": int(rng.integers(often) == 0), "drdy": int(rng.integers(often) == 0)}
            rows.append(row | {"drp_do": int(rng.integers(WORD.hi + 1))} | regs)
    return rows


def patient_stimuli(rng, _config):
    """Each bit of the longest time, at its end as far as a bench gets; words of any size on any channel."""
    rows = []
    idle = {"sample_trigger": 0, "busy": 0, "eoc": 0, "drdy": 0, "drp_do": 0}
    for bit in range(CLOCKS.width):
        for timeout in (1 << bit, 1 << bit | 5, (1 << bit) - 1):
            row = idle | settings(timeout=timeout)
            rows += [row | {"sample_trigger": 1}] + [row] * (min(timeout, 2500) + 9)
            rows += [row | {"eoc": 1, "drdy": 1}] * 60
    row = idle | settings(timeout=CLOCKS.hi - 9)
    rows += [row | {"sample_trigger": 1}] + [row] * (CLOCKS.hi + 9)
    for number in range(300):
        regs = settings(conversions=1 + number % 4, channels=1 + number // 4 % 4, signed_code=number & 1)
        regs |= {f"address_{k}": int(rng.integers(1 << 7)) for k in range(4)} | {"timeout": 300}
        for clock in range(70):
            word = int(rng.integers(WORD.hi + 1)) >> int(rng.integers(16))
            row = {"sample_trigger": int(clock == 2), "busy": 0, "eoc": int(clock % 9 == 8), "drdy": int(clock > 40)}
            rows.append(row | {"drp_do": word if clock & 1 else WORD.hi - word} | regs)
    return rows


INPUTS = (
    Port("sample_trigger", BIT, doc="1 for a clock: take a sample"),
    Port("busy", BIT, doc="1: the XADC converts"),
    Port("eoc", BIT, doc="1 for a clock: end of a conversion"),
    Port("drdy", BIT, doc="1 for a clock: drp_do is valid"),
    Port("drp_do", WORD, doc="data of the DRP"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("conversions", NUMBER, lo=1, hi=4, doc="conversions of a frame"),
    Port("channels", NUMBER, lo=1, hi=4, doc="channels that are read"),
    *(Port(f"address_{k}", ADDRESS, doc=f"DRP address of channel {k}") for k in range(4)),
    Port("timeout", CLOCKS, doc="longest time of a frame, clocks"),
    Port("signed_code", BIT, doc="1: the codes are two's complement"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="xadc_reader",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("convst", BIT, doc="rising edge: the inputs are held"),
        Port("den", BIT, doc="1 for a clock: read daddr"),
        Port("daddr", ADDRESS, doc="address of the DRP"),
        Port("codes_valid", BIT, doc="1 for a clock: the codes are new"),
        Port("frame_error", BIT, doc="1 for a clock: no codes for a trigger"),
        *(Port(f"code_{k}", CODE, doc=f"code of channel {k}") for k in range(4)),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"CONVST_CLOCKS": CONVST_CLOCKS},
    configs=({"ADC_BITS": 12}, {"ADC_BITS": 16}),
    width_from={f"code_{k}": code_format for k in range(4)},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
