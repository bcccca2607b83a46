# SPDX-License-Identifier: BSD-3-Clause
"""Which mode regulates this sample, and whether it is one of the first of its mode.

    mode       = position, else speed, else voltage with ``voltage_mode``, else torque
    by_voltage = the mode is voltage: the host's voltage takes the place of the current regulators'
    take_over  = speed or position mode, and the sample before had another mode: see speed_pi
               = position mode, and the sample before was its first: the torque of its trajectory begins here
    follows    = the voltage of this sample or of the one before is the host's: see current_pi

Formats: bits; nothing is rounded.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

MODE = Format(0, 2, 0)
TORQUE, VOLTAGE, SPEED, POSITION = range(4)


class State(NamedTuple):
    mode: int = TORQUE  # of the last sample
    fresh: int = 0  # it was the first of position mode


@kernel
def step(state, speed_mode, by_position, voltage_mode):
    mode = VOLTAGE if voltage_mode else TORQUE
    if speed_mode:
        mode = SPEED
    if by_position:
        mode = POSITION
    by_voltage = 1 if mode == VOLTAGE else 0
    begins = mode != state.mode
    take_over = 1 if mode >= SPEED and (begins or (mode == POSITION and state.fresh)) else 0
    follows = 1 if by_voltage or state.mode == VOLTAGE else 0
    return State(mode, 1 if begins and mode == POSITION else 0), (by_voltage, take_over, follows)


def stimuli(_rng, _config):
    """Every mode after every other."""
    rows = []
    for before in range(8):
        for after in range(8):
            for k in (before, after, after):
                rows.append({"speed_mode": k & 1, "by_position": k >> 1 & 1, "voltage_mode": k >> 2})
    return rows


BLOCK = Block(
    name="mode_change",
    folder="control",
    paper="none: docs/modes.md",
    step=step,
    inputs=(
        Port("speed_mode", BIT, doc="1: speed control, 0: torque control"),
        Port("by_position", BIT, doc="1: position control, over speed control"),
    ),
    registers=(Port("voltage_mode", BIT, doc="1: the voltage of u_d_ext and u_q_ext in place of torque control"),),
    outputs=(
        Port("by_voltage", BIT, doc="1: the voltage is the host's"),
        Port("take_over", BIT, doc="1: first sample of speed control, first two of position control"),
        Port("follows", BIT, doc="1: the current regulators follow the voltage"),
    ),
    state=State(),
    latency=1,
    constants={"MODE_W": MODE.width, "TORQUE": TORQUE, "VOLTAGE": VOLTAGE, "SPEED": SPEED, "POSITION": POSITION},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
