# SPDX-License-Identifier: BSD-3-Clause
"""The charge that the legs take from the bus, summed over the clocks of a step, from the gates of every clock.

    charge = sum of i_x over the clocks from one ``tick`` to the next and over the legs whose upper device conducts:
             the upper gate is on, or both are off and i_x < 0 flows through the upper diode

``tick`` marks a step's first clock.  The currents are taken at ``tick`` and hold for the step that begins, as the
voltages of motor_inverter, which counts both gates of a leg as the upper one, too.  ``charge`` is valid from the second
clock after ``tick`` on and stays for a step.
Formats: currents S(1,16), charge S(8,16), exact: modulo, but 31 clocks of the largest currents fit.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import wrap_s
from golden_model.formats import BIT, MOTOR_CHARGE, PU
from golden_model.kernel import kernel
from golden_model.modulation.gate_generation import LEGS

CHARGE_W = MOTOR_CHARGE.width


class State(NamedTuple):
    tick: int = 0
    gate_high: int = 0
    gate_low: int = 0
    i_a: int = 0
    i_b: int = 0
    i_c: int = 0
    sum: int = 0
    charge: int = 0


@kernel
def taken(high_gate, low_gate, i):
    """Current that a leg takes from the bus."""
    if high_gate or (not low_gate and i < 0):
        return i
    return 0


@kernel
def of_step(high, low, i, clocks):
    """Charge of a leg over a step of so many clocks, in ``high`` and ``low`` of which these gates are on."""
    return high * i + ((clocks - high - low) * i if i < 0 else 0)


@kernel
def step(state, inputs):
    x, s = inputs, state
    now = (
        taken(s.gate_high & 1, s.gate_low & 1, s.i_a)
        + taken(s.gate_high & 2, s.gate_low & 2, s.i_b)
        + taken(s.gate_high & 4, s.gate_low & 4, s.i_c)
    )
    following = State(
        x.tick,
        x.gate_high,
        x.gate_low,
        x.i_a if x.tick else s.i_a,
        x.i_b if x.tick else s.i_b,
        x.i_c if x.tick else s.i_c,
        now if s.tick else wrap_s(s.sum + now, CHARGE_W),
        s.sum if s.tick else s.charge,
    )
    return following, (following.charge,)


def stimuli(rng, _config):
    """Steps of 1 to 31 clocks with every state of the gates, the largest sums of both signs, currents around zero."""
    rows = []
    for length in (1, 2, 3, 7, 16, 20, 31):
        for part in range(10):
            edge = {0: PU.hi, 1: PU.lo, 2: 0, 3: -1, 4: 1}.get(part)
            amps = {f"i_{x}": int(rng.integers(PU.lo, PU.hi + 1)) if edge is None else edge for x in "abc"}
            for clock in range(length):
                high, low = (7, 0) if part < 2 else (int(rng.integers(8)), int(rng.integers(8)))
                rows.append(
                    amps | {"tick": int(clock == 0), "gate_high": high, "gate_low": low if part == 5 else low & ~high}
                )
    return rows


INPUTS = (
    Port("tick", BIT, doc="1: the first clock of a step"),
    Port("gate_high", LEGS, doc="upper gates, bit 0 is leg a"),
    Port("gate_low", LEGS, doc="lower gates, bit 0 is leg a"),
    *(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in "abc"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])

BLOCK = Block(
    name="motor_charge",
    folder="motor",
    paper="docs/hil.md: bus",
    step=step,
    takes=(Inputs,),
    inputs=INPUTS,
    outputs=(Port("charge", MOTOR_CHARGE, doc="charge that the legs took in the last step"),),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
