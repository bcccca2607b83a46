# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the front ends: pins, answers to triggers, codes that change together."""

from __future__ import annotations

from scripts.prove.proof import Fault, Proof, committed

FRAME = "converters/spi_frame.vhd"
WORDS = "converters/spi_words.vhd"
XADC = "converters/xadc_reader.vhd"


def spi_proof(name: str, says: str, macro: str, *faults: Fault, assumed: str = "constant registers") -> Proof:
    return Proof(
        name=f"spi_{name}",
        says=says,
        entity="spi_converter",
        harness=committed("spi_converter.sv"),
        faults=faults,
        method="pdr",
        generics={"ADC_BITS": 12, "LINES": 2},
        macros=(macro,),
        assumed=f"{assumed}, two lines of 12 bits",
        search_depth=90,
    )


def xadc_proof(name: str, says: str, macro: str, *faults: Fault, assumed: str = "nothing") -> Proof:
    return Proof(
        name=f"xadc_{name}",
        says=says,
        entity="xadc_reader",
        harness=committed("xadc_reader.sv"),
        faults=faults,
        method="pdr",
        generics={"ADC_BITS": 12},
        macros=(macro,),
        assumed=assumed,
        search_depth=50,
    )


PROOFS = (
    spi_proof(
        "pins",
        "convst is never high in a frame; sclk rests at its idle level without one",
        "PINS",
        Fault("frame begins with the conversion", FRAME, "cs_n        <= use_convst;", "cs_n        <= '0';"),
        Fault("clock idles low", FRAME, "clock_idle xor active", "active"),
    ),
    Proof(
        name="spi_codes_together",
        says="the codes change together, with codes_valid and at no other clock; absent lines and words are zero",
        entity="spi_words",
        harness=committed("spi_words.sv"),
        faults=(
            Fault("codes change early", WORDS, "if state.complete = '1' then", "if bit_taken = '1' then"),
            Fault("second word of one", WORDS, "          if two_words = '1' then", "          if skip_bits = 0 then"),
        ),
        method="pdr",
        generics={"ADC_BITS": 12, "LINES": 2},
        assumed="two lines of 12 bits",
        search_depth=40,
    ),
    spi_proof(
        "convst",
        "convst waits for BUSY and wait_clocks, and ends at busy_timeout with an error where no frame begins",
        "CONVST",
        Fault("BUSY not awaited", FRAME, " and busy_now = '0' then", " then"),
        Fault("no time-out", FRAME, "elsif state.elapsed >= busy_timeout then", "elsif state.elapsed = 65535 then"),
        assumed="constant registers, busy_timeout below 40",
    ),
    xadc_proof(
        "answer",
        "a trigger is answered by codes or by an error, at the latest two clocks after the time-out",
        "ANSWER",
        Fault("no time-out", XADC, "state.elapsed >= timeout", "state.elapsed = 65535"),
        Fault("trigger lost while busy", XADC, "(state.phase /= idle or busy = '1')", "(state.phase /= idle)"),
        assumed="time-out below 40 and constant, no trigger during a frame",
    ),
    xadc_proof(
        "one_read",
        "den comes once for each drdy of a frame",
        "ONE_READ",
        Fault("asks again while it waits", XADC, "elsif drdy = '1' then", "elsif drdy = '1' or eoc = '1' then"),
    ),
    xadc_proof(
        "codes_together",
        "the codes change together, with codes_valid and at no other clock",
        "TOGETHER",
        Fault("codes change while they are read", XADC, "state.read(k) <= drp_do;",
              "state.read(k) <= drp_do;\n            code_0 <= drp_do(15 downto 16 - ADC_BITS);"),
    ),
)  # fmt: skip
