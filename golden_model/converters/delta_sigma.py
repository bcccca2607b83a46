# SPDX-License-Identifier: BSD-3-Clause
"""Four delta-sigma modulators to codes: their bits, a sinc3 each, and fast overcurrent of the three phases, wired.

Nothing is computed here.  Modulators 0 to 3 are a, b, c and the bus.  All filters see the same strobes, so the codes
come together; one ``code_valid`` and one ``window_error`` stand for all.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.converters import modulator_input, sinc3, sinc_overcurrent
from golden_model.fixed import Format
from golden_model.formats import BIT, CODE
from golden_model.kernel import kernel

LINES = 4
input_step, sinc_step, over_step = modulator_input.step, sinc3.step, sinc_overcurrent.step


class State(NamedTuple):
    of_input: modulator_input.State = modulator_input.State()
    of_sinc_a: sinc3.State = sinc3.State()
    of_sinc_b: sinc3.State = sinc3.State()
    of_sinc_c: sinc3.State = sinc3.State()
    of_sinc_u_dc: sinc3.State = sinc3.State()
    of_over_a: sinc_overcurrent.State = sinc_overcurrent.State()
    of_over_b: sinc_overcurrent.State = sinc_overcurrent.State()
    of_over_c: sinc_overcurrent.State = sinc_overcurrent.State()
    # Outputs that the next clock reads
    bits: int = 0
    bits_valid: int = 0


@kernel
def step(state, inputs, regs, adc_bits):
    x, r = inputs, regs
    s = state
    taken, (mod_clock, bits, bits_valid) = input_step(
        s.of_input, x.mod_data, x.mod_clock_in, r.mod_ratio, r.mod_delay, r.follow_clock, LINES
    )
    bit_a, bit_b, bit_c, bit_u_dc = s.bits & 1, s.bits >> 1 & 1, s.bits >> 2 & 1, s.bits >> 3 & 1
    new = s.bits_valid
    sinc_a, (code_a, code_valid, window_error) = sinc_step(
        s.of_sinc_a, x.sample_trigger, bit_a, new, r.oversampling, r.sinc_gain, r.start_clocks, adc_bits
    )
    sinc_b, (code_b, _, _) = sinc_step(
        s.of_sinc_b, x.sample_trigger, bit_b, new, r.oversampling, r.sinc_gain, r.start_clocks, adc_bits
    )
    sinc_c, (code_c, _, _) = sinc_step(
        s.of_sinc_c, x.sample_trigger, bit_c, new, r.oversampling, r.sinc_gain, r.start_clocks, adc_bits
    )
    sinc_u_dc, (code_u_dc, _, _) = sinc_step(
        s.of_sinc_u_dc, x.sample_trigger, bit_u_dc, new, r.oversampling, r.sinc_gain, r.start_clocks, adc_bits
    )
    over_a, (is_over_a, _, _) = over_step(s.of_over_a, bit_a, new, r.trip_oversampling, r.limit_high, r.limit_low)
    over_b, (is_over_b, _, _) = over_step(s.of_over_b, bit_b, new, r.trip_oversampling, r.limit_high, r.limit_low)
    over_c, (is_over_c, _, _) = over_step(s.of_over_c, bit_c, new, r.trip_oversampling, r.limit_high, r.limit_low)
    following = State(taken, sinc_a, sinc_b, sinc_c, sinc_u_dc, over_a, over_b, over_c, bits, bits_valid)
    over = 1 if is_over_a or is_over_b or is_over_c else 0
    return following, (mod_clock, code_a, code_b, code_c, code_u_dc, code_valid, window_error, over)


def stimuli(rng, config):
    """Bits of every density, windows that end, that do not, and that are short of bits."""
    rows = []
    row = {p.name: p.low for p in BLOCK.inputs + BLOCK.registers} | {"oversampling": 32, "trip_oversampling": 8}
    row |= {"sinc_gain": 1 << 14, "limit_high": 500, "limit_low": 12, "mod_ratio": 4}
    for spacing, density in ((500, 0.5), (450, 0.9), (420, 0.02), (300, 0.5)):
        for k in range(1800):
            word = int(sum((rng.random() < density) << x for x in range(LINES)))
            rows.append(row | {"mod_data": word, "sample_trigger": int(k % spacing == 9)})
    return rows


def patient_stimuli(_rng, _config):
    """Each phase in turn at a limit of the fast filter, and beside it by each bit: no other phase is near."""
    rows, short = [], 8
    row = {p.name: p.low for p in BLOCK.inputs + BLOCK.registers} | {"oversampling": 32, "trip_oversampling": short}
    row |= {"sinc_gain": 1 << 14, "mod_ratio": 4}
    for phase in range(3):
        for ones, at in ((6, "limit_high"), (2, "limit_low")):  # of ``short`` bits; the others have one half
            total = ones * short**2
            for limit in (total, *(total + sign * (1 << bit) for bit in range(10) for sign in (1, -1))):
                limits = {"limit_high": short**3 + 1, "limit_low": 0, at: max(limit, 0)}
                for bit in range(6 * short):
                    word = sum((bit % short < (ones if line == phase else short // 2)) << line for line in range(LINES))
                    rows += [row | limits | {"mod_data": word}] * row["mod_ratio"]
    return rows


_PORTS = {p.name: p for m in (sinc3, modulator_input) for p in m.BLOCK.inputs + m.BLOCK.registers + m.BLOCK.outputs}
_OVER = {p.name: p for p in sinc_overcurrent.BLOCK.registers}


def renamed(port, name, doc=None):
    """The same port under a name that is its own on a board."""
    return Port(name, port.fmt, port.lo, port.hi, doc or port.doc)


REGISTERS = (
    _PORTS["mod_ratio"],
    renamed(_PORTS["sample_delay"], "mod_delay"),
    _PORTS["follow_clock"],
    _PORTS["oversampling"],
    renamed(_PORTS["gain"], "sinc_gain"),
    _PORTS["start_clocks"],
    renamed(_OVER["oversampling"], "trip_oversampling", "bits from total to total of the fast overcurrent"),
    _OVER["limit_high"],
    _OVER["limit_low"],
)

INPUTS = (
    Port("mod_data", Format(0, LINES, 0), doc="data of the modulators a, b, c, bus, not synchronous"),
    _PORTS["mod_clock_in"],
    _PORTS["sample_trigger"],
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="delta_sigma",
    folder="converters",
    paper="none: front end of a board",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        _PORTS["mod_clock"],
        *(Port(f"code_{x}", CODE, doc=f"density of ones, {x}") for x in ("a", "b", "c", "u_dc")),
        _PORTS["code_valid"],
        _PORTS["window_error"],
        Port("over", BIT, doc="1: the fast filter of a phase is beyond a limit"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"ADC_BITS": 16},),
    width_from={f"code_{x}": sinc3.BLOCK.width_from["code"] for x in ("a", "b", "c", "u_dc")},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
