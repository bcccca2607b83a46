# SPDX-License-Identifier: BSD-3-Clause
"""ADC codes to phase currents: i_x = gain_x * (code_x - offset_x).

Formats: codes of 12 to 16 bits are left-aligned in 16 bits, so that offset and gain do not depend on
the converter's resolution.  Difference S(1,15) x gain S(1,16) = 31 fraction bits, rounded half up to PU.
Saturation: |code - offset| < 2 and |gain| <= 2 can reach 4 per unit; beyond 2 the current saturates;
a sensor that is scaled to its base does not reach it.
With ``two_sensors`` phase a has none: i_a = -(i_b + i_c), saturated at 2 per unit, which reaches every i_trip, and its
rail flag is 0, since its code is no measurement.  Any leg may be called a, because the phases turn in a circle.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_sat, saturate
from golden_model.formats import BIT, CODE, GAIN, PU, PU_W
from golden_model.kernel import kernel

DROP = CODE.frac_bits + GAIN.frac_bits - PU.frac_bits


@kernel
def condition(code, offset, gain, shift):
    """One channel."""
    diff = (code << shift) - offset
    prod = diff * gain
    return round_sat(prod, DROP, PU_W)


@kernel
def at_rail(code, adc_bits):
    """1 for the lowest and the highest code: the input may be beyond the range of the converter."""
    return 1 if code == 0 or code == (1 << adc_bits) - 1 else 0


@kernel
def step(
    code_a, code_b, code_c, offset_a, offset_b, offset_c, gain_a, gain_b, gain_c, two_sensors, adc_bits
):  # fmt: skip
    shift = 16 - adc_bits
    i_a = condition(code_a, offset_a, gain_a, shift)
    i_b = condition(code_b, offset_b, gain_b, shift)
    i_c = condition(code_c, offset_c, gain_c, shift)
    if two_sensors:
        i_a = saturate(-(i_b + i_c), PU_W)
    rail_a, rail_b, rail_c = at_rail(code_a, adc_bits), at_rail(code_b, adc_bits), at_rail(code_c, adc_bits)
    return i_a, i_b, i_c, (0 if two_sensors else rail_a) + 2 * rail_b + 4 * rail_c


def reference(v, _state):
    real = {f"i_{x}": PU.limit((v[f"code_{x}"] - v[f"offset_{x}"]) * v[f"gain_{x}"]) for x in "abc"}
    return real | ({"i_a": PU.limit(-real["i_b"] - real["i_c"])} if v["two_sensors"] else {})


def bound(v, _state):
    """Only the last step rounds; a current made of two has the errors of both."""
    return {f"i_{x}": PU.lsb / 2 for x in "abc"} | ({"i_a": PU.lsb} if v["two_sensors"] else {})


def stimuli(_rng, config):
    """Rails, the offset itself, and one code either side, with gains of both signs."""
    top = (1 << config["ADC_BITS"]) - 1
    rows = []
    for gain in (65536, -65536, 131071, -131072, 1):
        for code in (0, 1, top // 2, top // 2 + 1, top - 1, top):
            row = {f"code_{x}": code for x in "abc"}
            row |= {f"offset_{x}": 32768 + k for k, x in enumerate("abc")} | {f"gain_{x}": gain for x in "abc"}
            rows += [row, row | {"two_sensors": 1}]
    return rows


def code_format(config):
    return Format(0, 1, config["ADC_BITS"] - 1)


BLOCK = Block(
    name="current_conditioning",
    folder="io",
    paper="001, section 5.2, I/O conditioning",
    step=step,
    inputs=tuple(Port(f"code_{x}", CODE, doc=f"ADC code, phase {x}") for x in "abc"),
    registers=tuple(Port(f"offset_{x}", CODE, doc=f"code at zero current, phase {x}, left-aligned") for x in "abc")
    + tuple(Port(f"gain_{x}", GAIN, doc=f"current per code, phase {x}") for x in "abc")
    + (Port("two_sensors", BIT, doc="1: phase a has no sensor, its current is minus the sum of the others"),),
    outputs=tuple(Port(f"i_{x}", PU, doc=f"current, phase {x}") for x in "abc")
    + (Port("current_at_rail", Format(0, 3, 0), doc="bit x: ADC code of phase x at either end"),),
    latency=5,
    soon=("i_b", "i_c"),
    interval=3,
    constants={"DROP": DROP},
    configs=({"ADC_BITS": 16}, {"ADC_BITS": 14}, {"ADC_BITS": 12}),
    width_from={f"code_{x}": code_format for x in "abc"},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
