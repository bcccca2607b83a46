# SPDX-License-Identifier: BSD-3-Clause
"""The voltage of each leg, summed over the clocks of a step, from the gates of every clock.

    leg_x = sum of (high_x, low_x or off_x) over the clocks from one ``tick`` to the next; ``tick`` marks a step's first

The voltages are taken at ``tick`` and hold for the step that begins.  A clock with the upper gate on counts as high.
``shoot_through`` stays 1 from a clock in which both gates of a leg are on until ``clear_faults``.  ``leg_x`` are valid
from the second clock after ``tick`` on and stay for a step.
Formats: voltages S(1,22), sums S(6,22), exact: modulo, but 31 clocks of the largest voltage fit.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import wrap_s
from golden_model.formats import BIT, MOTOR_LEG, MOTOR_VOLTAGE
from golden_model.kernel import kernel
from golden_model.modulation.gate_generation import LEGS

LEG_W = MOTOR_LEG.width
VOLTAGES = [f"{kind}_{x}" for x in "abc" for kind in ("high", "low", "off")]


class State(NamedTuple):
    tick: int = 0
    gate_high: int = 0
    gate_low: int = 0
    high_a: int = 0
    low_a: int = 0
    off_a: int = 0
    high_b: int = 0
    low_b: int = 0
    off_b: int = 0
    high_c: int = 0
    low_c: int = 0
    off_c: int = 0
    sum_a: int = 0
    sum_b: int = 0
    sum_c: int = 0
    leg_a: int = 0
    leg_b: int = 0
    leg_c: int = 0
    shoot_through: int = 0


@kernel
def voltage(high_gate, low_gate, high, low, off):
    """Voltage of a leg with these gates."""
    if high_gate:
        return high
    return low if low_gate else off


@kernel
def step(state, inputs):
    x, s = inputs, state
    u_a = voltage(s.gate_high & 1, s.gate_low & 1, s.high_a, s.low_a, s.off_a)
    u_b = voltage(s.gate_high & 2, s.gate_low & 2, s.high_b, s.low_b, s.off_b)
    u_c = voltage(s.gate_high & 4, s.gate_low & 4, s.high_c, s.low_c, s.off_c)
    shoot_through = 1 if s.gate_high & s.gate_low or (s.shoot_through and not x.clear_faults) else 0
    following = State(
        x.tick,
        x.gate_high,
        x.gate_low,
        x.high_a if x.tick else s.high_a,
        x.low_a if x.tick else s.low_a,
        x.off_a if x.tick else s.off_a,
        x.high_b if x.tick else s.high_b,
        x.low_b if x.tick else s.low_b,
        x.off_b if x.tick else s.off_b,
        x.high_c if x.tick else s.high_c,
        x.low_c if x.tick else s.low_c,
        x.off_c if x.tick else s.off_c,
        u_a if s.tick else wrap_s(s.sum_a + u_a, LEG_W),
        u_b if s.tick else wrap_s(s.sum_b + u_b, LEG_W),
        u_c if s.tick else wrap_s(s.sum_c + u_c, LEG_W),
        s.sum_a if s.tick else s.leg_a,
        s.sum_b if s.tick else s.leg_b,
        s.sum_c if s.tick else s.leg_c,
        shoot_through,
    )
    return following, (following.leg_a, following.leg_b, following.leg_c, shoot_through)


def stimuli(rng, _config):
    """Steps of 1 to 31 clocks with every state of the gates, the largest sums of both signs, both gates of a leg."""
    rows = []
    for length in (1, 2, 3, 7, 16, 20, 31):
        for part in range(8):
            edge = {0: MOTOR_VOLTAGE.hi, 1: MOTOR_VOLTAGE.lo}.get(part)
            volts = {n: edge or int(rng.integers(MOTOR_VOLTAGE.lo, MOTOR_VOLTAGE.hi + 1)) for n in VOLTAGES}
            for clock in range(length):
                high, low = int(rng.integers(8)), int(rng.integers(8))
                row = {"tick": int(clock == 0), "gate_high": high, "gate_low": low if part == 5 else low & ~high}
                rows.append(volts | row | {"clear_faults": int(clock == length // 2 and part == 7)})
    return rows


INPUTS = (
    Port("tick", BIT, doc="1: the first clock of a step"),
    Port("gate_high", LEGS, doc="upper gates, bit 0 is leg a"),
    Port("gate_low", LEGS, doc="lower gates, bit 0 is leg a"),
    *(Port(name, MOTOR_VOLTAGE, doc="voltage of a leg, from motor_legs") for name in VOLTAGES),
    Port("clear_faults", BIT, doc="1: clear shoot_through"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])

BLOCK = Block(
    name="motor_inverter",
    folder="motor",
    paper="docs/hil.md: legs of the inverter",
    step=step,
    takes=(Inputs,),
    inputs=INPUTS,
    outputs=(
        *(Port(f"leg_{x}", MOTOR_LEG, doc=f"voltage of leg {x}, summed over the last step") for x in "abc"),
        Port("shoot_through", BIT, doc="1: both gates of a leg were on"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
