# SPDX-License-Identifier: BSD-3-Clause
"""What the sensors of a drive say about the motor: codes of three currents, of the bus voltage and of the angle.

    code  = limit(gain*value + offset + noise)       in the scale of CODE; the middle is zero current
    noise = (sum of the four signed bytes of a random number)*amplitude/256, nearly normal
    code_theta = theta_m + angle_offset              cut to the encoder's bits

The random numbers are those of a xorshift of 32 bits, a new one for each channel of each sample: a, b, c, bus.
Formats: gain S(4,20), offset PU, amplitude U(0,24), a unit of 2**-16 in steps of a 256th: sigma is 148 times that.
Sums 16 fraction bits, products half up; codes half up, limited to 0 and the highest code; the angle wraps.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.fixed import Format, clamp, round_half_up, wrap
from golden_model.formats import MOTOR_ANGLE, MOTOR_VOLTAGE, PU
from golden_model.io.position import code_format as position_format
from golden_model.io.u_dc_conditioning import code_format
from golden_model.kernel import kernel

SENSOR_GAIN = Format(1, 4, 20)
AMPLITUDE = Format(0, -16, 24)
SEED = 0x2545F491
MASK = (1 << 32) - 1
ANGLE_W = MOTOR_ANGLE.width
Y_W = 22
DROP_BUS = MOTOR_VOLTAGE.frac_bits - PU.frac_bits
DROP_NOISE = AMPLITUDE.frac_bits - PU.frac_bits
DROP_GAIN = SENSOR_GAIN.frac_bits
CODE_BITS = PU.frac_bits + 1  # of a code at the scale of the sums
ZERO = 1 << PU.frac_bits  # the code of zero current, and the upper half of the converter's range


class State(NamedTuple):
    random: int = SEED


@kernel
def drawn(random):
    """The next random number."""
    random ^= (random << 13) & MASK
    random ^= random >> 17
    return random ^ ((random << 5) & MASK)


@kernel
def bell(random):
    """Sum of its bytes as signed numbers."""
    total = 0
    for k in range(4):
        byte = (random >> (8 * k)) & 255
        total += byte - 256 * (byte >> 7)
    return total


@kernel
def converted(value, gain, offset, noise, middle, adc_bits):
    """Code of a channel."""
    y, _ = multiply_add(gain, value, offset + noise, DROP_GAIN, Y_W)
    return clamp(round_half_up(y + middle, CODE_BITS - adc_bits), 0, (1 << adc_bits) - 1)


@kernel
def step(state, inputs, regs, adc_bits, position_bits):
    x, r = inputs, regs
    of_a = drawn(state.random)
    of_b = drawn(of_a)
    of_c = drawn(of_b)
    of_bus = drawn(of_c)
    noise_a = round_half_up(bell(of_a) * r.noise_i, DROP_NOISE)
    noise_b = round_half_up(bell(of_b) * r.noise_i, DROP_NOISE)
    noise_c = round_half_up(bell(of_c) * r.noise_i, DROP_NOISE)
    noise_u = round_half_up(bell(of_bus) * r.noise_u, DROP_NOISE)
    theta = wrap(x.theta_m + r.angle_offset, ANGLE_W) >> (ANGLE_W - position_bits)
    return State(of_bus), (
        converted(x.i_a, r.scale_a, r.zero_a, noise_a, ZERO, adc_bits),
        converted(x.i_b, r.scale_b, r.zero_b, noise_b, ZERO, adc_bits),
        converted(x.i_c, r.scale_c, r.zero_c, noise_c, ZERO, adc_bits),
        converted(x.u_dc >> DROP_BUS, r.scale_u, r.zero_u, noise_u, 0, adc_bits),
        theta,
    )


def reference(v, state):
    """In CODE's scale; the noise is that of the random numbers."""
    random, result, top = state.random, {}, 2.0 - 2.0 ** (1 - v["ADC_BITS"])
    for name, channel in (("a", "i"), ("b", "i"), ("c", "i"), ("u_dc", "u")):
        random = drawn(random)
        bus = name == "u_dc"
        value, key = (v["u_dc"], "u") if bus else (v[f"i_{name}"], name)
        y = v[f"scale_{key}"] * value + v[f"zero_{key}"] + bell(random) * v[f"noise_{channel}"]
        result[f"code_{name}"] = min(max(y + (0.0 if bus else 1.0), 0.0), top)
    return result | {"code_theta": (v["theta_m"] + v["angle_offset"]) % 1}


def bound(v, _state):
    """Roundings of noise and product, the bus cut to PU, half a code; the angle is cut."""
    half, channel = 2.0 ** -v["ADC_BITS"], PU.lsb
    bounds = {f"code_{x}": half + channel for x in "abc"}
    bounds["code_u_dc"] = half + channel + abs(v["scale_u"]) * PU.lsb
    return bounds | {"code_theta": 2.0 ** -v["POSITION_BITS"]}


def stimuli(_rng, _config):
    """Rails and middle of each channel, ties of the code's rounding, an angle at its wrap, the largest noise."""
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers}
    one = {f"scale_{x}": 1 << 20 for x in "abcu"}
    rows = []
    for value in (PU.lo, PU.lo // 2, -1, 0, 1, 7, 8, 9, PU.hi // 2, PU.hi):
        for zero in (0, 1, -1):
            row = {f"i_{x}": value for x in "abc"} | {f"zero_{x}": zero for x in "abcu"}
            rows.append(still | one | row | {"u_dc": max(value, 0) << DROP_BUS, "theta_m": value & 0x1FFFFFF})
    rows += [still | one | {"noise_i": AMPLITUDE.hi, "noise_u": AMPLITUDE.hi, "u_dc": 1 << 22}] * 40
    for gain in (SENSOR_GAIN.lo, SENSOR_GAIN.hi, 1 << 19):
        rows += [still | {f"scale_{x}": gain for x in "abcu"} | {"i_a": PU.lo, "i_b": PU.hi, "i_c": 3, "u_dc": 1 << 21}]
    rows += [
        still | {"theta_m": MOTOR_ANGLE.hi - k, "angle_offset": m} for k in (0, 1) for m in (0, 1, 2, MOTOR_ANGLE.hi)
    ]
    return rows


INPUTS = (
    *(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in "abc"),
    Port("u_dc", MOTOR_VOLTAGE, lo=0, doc="bus voltage"),
    Port("theta_m", MOTOR_ANGLE, doc="mechanical angle"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    *(Port(f"scale_{x}", SENSOR_GAIN, doc=f"code per current, phase {x}") for x in "abc"),
    Port("scale_u", SENSOR_GAIN, doc="code per bus voltage"),
    *(Port(f"zero_{x}", PU, doc=f"offset of the code, phase {x}") for x in "abc"),
    Port("zero_u", PU, doc="offset of the code, bus voltage"),
    Port("noise_i", AMPLITUDE, doc="noise of the currents"),
    Port("noise_u", AMPLITUDE, doc="noise of the bus voltage"),
    Port("angle_offset", MOTOR_ANGLE, doc="angle of the encoder at the motor's zero"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="motor_sensors",
    folder="motor",
    paper="docs/hil.md: sensors",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        *(Port(f"code_{x}", Format(0, 1, 15), doc=f"ADC code of phase {x}") for x in "abc"),
        Port("code_u_dc", Format(0, 1, 15), doc="ADC code of the bus voltage"),
        Port("code_theta", Format(0, 0, 18), doc="code of the angle"),
    ),
    state=State(),
    latency=11,
    interval=11,
    width_from={
        **dict.fromkeys(("code_a", "code_b", "code_c", "code_u_dc"), code_format),
        "code_theta": position_format,
    },
    configs=({"ADC_BITS": 12, "POSITION_BITS": 16}, {"ADC_BITS": 16, "POSITION_BITS": 18}),
    constants={"DROP_BUS": DROP_BUS, "DROP_NOISE": DROP_NOISE, "DROP_GAIN": DROP_GAIN, "SEED": SEED},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
