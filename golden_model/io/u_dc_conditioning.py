# SPDX-License-Identifier: BSD-3-Clause
"""ADC code to bus voltage and to the radius of the voltage circle.

    u_dc  = u_dc_gain * (code_u_dc - u_dc_offset)        not below zero
    u_max = k_u_max * u_dc                               k_u_max = 1/sqrt(3), or less to keep a reserve

Rounding: u_dc half up; u_max floor, so that the circle is never larger than the bus allows.
Saturation: u_dc at 0 and 2 per unit, u_max at 1 per unit: choose the voltage base so that the bus
stays below sqrt(3).  ``u_dc_at_rail`` = 1: the code was at either end.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up, saturate_u
from golden_model.formats import BIT, CODE, GAIN, U_DC, U_MAX
from golden_model.io.current_conditioning import at_rail
from golden_model.kernel import kernel

K_U_MAX = Format(0, 0, 17)
DROP_U_DC = CODE.frac_bits + GAIN.frac_bits - U_DC.frac_bits
DROP_U_MAX = U_DC.frac_bits + K_U_MAX.frac_bits - U_MAX.frac_bits
AHEAD = 3  # clocks from the bus voltage to the radius
U_DC_W, U_MAX_W = U_DC.width, U_MAX.width


@kernel
def step(code_u_dc, u_dc_offset, u_dc_gain, k_u_max, adc_bits):
    code = code_u_dc << (16 - adc_bits)
    diff = code - u_dc_offset
    u_dc = saturate_u(round_half_up(diff * u_dc_gain, DROP_U_DC), U_DC_W)
    u_max = saturate_u((u_dc * k_u_max) >> DROP_U_MAX, U_MAX_W)
    return u_dc, u_max, at_rail(code_u_dc, adc_bits)


def reference(v, _state):
    u_dc = U_DC.limit(v["u_dc_gain"] * (v["code_u_dc"] - v["u_dc_offset"]))
    return {"u_dc": u_dc, "u_max": U_MAX.limit(v["k_u_max"] * u_dc)}


def bound(v, _state):
    return {"u_dc": U_DC.lsb / 2, "u_max": v["k_u_max"] * U_DC.lsb / 2 + U_MAX.lsb}


def code_format(config):
    return Format(0, 1, config["ADC_BITS"] - 1)


def stimuli(_rng, config):
    top = (1 << config["ADC_BITS"]) - 1
    return [
        {"code_u_dc": code, "u_dc_offset": off, "u_dc_gain": gain, "k_u_max": k}
        for code in (0, 1, top // 2, top - 1, top)
        for off in (0, 1, 40000)
        for gain in (65536, 131071, -65536)
        for k in (0, 75675, 131071)
    ]


BLOCK = Block(
    name="u_dc_conditioning",
    folder="io",
    paper="001, section 5.2, I/O conditioning",
    step=step,
    inputs=(Port("code_u_dc", CODE, doc="ADC code, bus voltage"),),
    registers=(
        Port("u_dc_offset", CODE, doc="code at zero bus voltage, left-aligned"),
        Port("u_dc_gain", GAIN, doc="bus voltage per code"),
        Port("k_u_max", K_U_MAX, doc="radius of the voltage circle / bus voltage"),
    ),
    outputs=(
        Port("u_dc", U_DC, doc="bus voltage"),
        Port("u_max", U_MAX, doc="radius of the voltage circle"),
        Port("u_dc_at_rail", BIT, doc="code at either end"),
    ),
    latency=7,
    interval=4,
    soon=("u_dc", "u_dc_at_rail"),
    ahead=AHEAD,
    constants={"AHEAD": AHEAD, "DROP_U_DC": DROP_U_DC, "DROP_U_MAX": DROP_U_MAX},
    configs=({"ADC_BITS": 16}, {"ADC_BITS": 12}),
    width_from={"code_u_dc": code_format},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
