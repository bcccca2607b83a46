# SPDX-License-Identifier: BSD-3-Clause
"""The voltage that each leg of the inverter has in each state of its gates, from the sign and the size of its current.

    x      = stiffness*i                             stiffness: voltage per current, see below
    v_high = u_dc - clamp(x, -v_diode, v_switch)     upper gate on: the switch conducts i > 0, the diode i < 0
    v_low  =      - clamp(x, -v_switch, v_diode)     lower gate on
    v_off  = clamp(u_dc/2 - x, -v_diode, u_dc + v_diode)     both off: i > 0 the lower diode, i < 0 the upper one

Around zero current the sign function is a line of the slope ``stiffness``, the leg's snubber: without it a current that
a diode has brought to zero would swing by u_dc*T/L around zero.  It is as stiff as the delay of the model allows.
The slope resistance of the devices is part of r_a to r_c.
Formats: u_dc, drops and results S(1,22); stiffness U(9,8), x rounded half up to 22 fraction bits and saturated to 8.
"""

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.fixed import Format, clamp, saturate
from golden_model.formats import MOTOR_VOLTAGE, PU
from golden_model.kernel import kernel

STIFFNESS = Format(0, 9, 8)
DROP_V = Format(0, 0, 22)  # a drop of a device: below one
DROP_X = STIFFNESS.frac_bits + PU.frac_bits - MOTOR_VOLTAGE.frac_bits
V_W, X_W = MOTOR_VOLTAGE.width, 26
LEGS = "abc"


@kernel
def leg(i, u_dc, stiffness, v_switch, v_diode):
    """(v_high, v_low, v_off) of a leg."""
    x, _ = multiply_add(stiffness, i, 0, DROP_X, X_W)
    v_high = saturate(u_dc - clamp(x, -v_diode, v_switch), V_W)
    v_low = -clamp(x, -v_switch, v_diode)
    v_off = saturate(clamp((u_dc >> 1) - x, -v_diode, u_dc + v_diode), V_W)
    return v_high, v_low, v_off


@kernel
def step(i_a, i_b, i_c, u_dc, stiffness, v_switch, v_diode):
    high_a, low_a, off_a = leg(i_a, u_dc, stiffness, v_switch, v_diode)
    high_b, low_b, off_b = leg(i_b, u_dc, stiffness, v_switch, v_diode)
    high_c, low_c, off_c = leg(i_c, u_dc, stiffness, v_switch, v_diode)
    return high_a, low_a, off_a, high_b, low_b, off_b, high_c, low_c, off_c


def reference(v, _state):
    top, drops, u_dc = 2.0 - MOTOR_VOLTAGE.lsb, (v["v_switch"], v["v_diode"]), v["u_dc"]
    result = {}
    for name in LEGS:
        x = v["stiffness"] * v[f"i_{name}"]
        result[f"high_{name}"] = min(u_dc - min(max(x, -drops[1]), drops[0]), top)
        result[f"low_{name}"] = -min(max(x, -drops[0]), drops[1])
        result[f"off_{name}"] = min(max(u_dc / 2 - x, -drops[1]), u_dc + drops[1], top)
    return result


def bound(_v, _state):
    """Half an LSB of x, and the LSB that u_dc/2 loses."""
    return {f"{kind}_{name}": 1.5 * MOTOR_VOLTAGE.lsb for kind in ("high", "low", "off") for name in LEGS}


def stimuli(_rng, _config):
    """Currents at which each clamp begins to hold, and beside them, with both signs; all of u_dc and none."""
    rows = []
    one = 1 << MOTOR_VOLTAGE.frac_bits
    for u_dc in (0, one // 3, MOTOR_VOLTAGE.hi):
        for v_switch, v_diode in ((0, 0), (one // 64, one // 40), (DROP_V.hi, DROP_V.hi), (0, one // 40)):
            for stiffness in (0, 1 << 8, 1 << 14, STIFFNESS.hi):
                row = {"u_dc": u_dc, "stiffness": stiffness, "v_switch": v_switch, "v_diode": v_diode}
                at = [v * 4 // max(stiffness, 1) for v in (v_switch, v_diode, u_dc // 2, u_dc // 2 + v_diode)]
                for place in at:
                    for off in (-1, 0, 1):
                        i = min(place + off, PU.hi)
                        rows.append(row | {"i_a": i, "i_b": -i, "i_c": i // 2})
    return rows


BLOCK = Block(
    name="motor_legs",
    folder="motor",
    paper="docs/hil.md: legs of the inverter",
    step=step,
    inputs=(
        *(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in LEGS),
        Port("u_dc", MOTOR_VOLTAGE, lo=0, doc="bus voltage"),
    ),
    registers=(
        Port("stiffness", STIFFNESS, doc="slope of a leg's voltage around zero current"),
        Port("v_switch", DROP_V, doc="voltage of a conducting switch"),
        Port("v_diode", DROP_V, doc="voltage of a conducting diode"),
    ),
    outputs=tuple(
        Port(f"{kind}_{x}", MOTOR_VOLTAGE, doc=f"voltage of leg {x}, {what}")
        for x in LEGS
        for kind, what in (("high", "upper gate on"), ("low", "lower gate on"), ("off", "both gates off"))
    ),
    latency=9,
    interval=8,
    constants={"DROP_X": DROP_X},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
