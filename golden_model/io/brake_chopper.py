# SPDX-License-Identifier: BSD-3-Clause
"""Switches the brake resistor with hysteresis on the bus voltage: what a braking motor returns is turned into heat.

    brake = 1 from u_dc >= brake_on until u_dc < brake_off;  brake_on = 0: no chopper

Does not depend on the gates: a motor that is driven feeds the bus through the diodes.
Formats: u_dc cut (floor) to U(1,8).  With brake_off above brake_on the bus decides anew in every sample.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.formats import BIT, LIMIT, U_DC
from golden_model.io.sample_checks import DROP_LIMIT
from golden_model.kernel import kernel


class State(NamedTuple):
    brake: int = 0


@kernel
def step(state, u_dc, brake_on, brake_off):
    bus = u_dc >> DROP_LIMIT
    brake = 1 if bus >= brake_on else (0 if bus < brake_off else state.brake)
    brake = brake if brake_on != 0 else 0
    return State(brake), (brake,)


def stimuli(_rng, _config):
    """Both limits met and just missed, up and down; without a chopper; limits that contradict each other."""
    rows = []
    for on, off in ((300, 280), (300, 300), (280, 300), (0, 0), (0, 300), (1, 0)):
        limits = {"brake_on": on, "brake_off": off}
        for edge in (280 << 8, 300 << 8, 1 << 8):
            for near in (-1, 0, 1):
                for before in (0, 131071, 0, 290 << 8):
                    rows += [limits | {"u_dc": before}, limits | {"u_dc": edge + near}]
    return rows


BLOCK = Block(
    name="brake_chopper",
    folder="io",
    paper="none: protection of the drive",
    step=step,
    inputs=(Port("u_dc", U_DC, doc="bus voltage"),),
    registers=(
        Port("brake_on", LIMIT, doc="bus voltage from which the brake resistor is on; 0: none"),
        Port("brake_off", LIMIT, doc="bus voltage below which it is off"),
    ),
    outputs=(Port("brake_asked", BIT, doc="1: the bus asks for the brake resistor"),),
    state=State(),
    latency=1,
    interval=1,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
