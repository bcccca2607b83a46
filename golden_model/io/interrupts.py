# SPDX-License-Identifier: BSD-3-Clause
"""The interrupt: causes that software clears, and a mask; runs at every clock.

    cause 0  a trip is latched (tripped)
          1  a fault appeared in fault_flags, whether it trips or not
          2  dead_time and min_pulse contradict each other (setting_refused)
          3  the gates were on and are off
          4  the motor is not the one described (motor_differs)
    irq = a cause that irq_mask does not mask

A cause stays until ``irq_clear`` has a one in its bit; what is still present (0, 2, 4) sets it again at once.
Formats: bits.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.io.fault_latch import FLAGS
from golden_model.kernel import kernel

CAUSES = Format(0, 5, 0)


class State(NamedTuple):
    causes: int = 0
    flags: int = 0  # fault_flags of the last clock
    running: int = 0  # likewise


@kernel
def step(state, tripped, fault_flags, setting_refused, running, motor_differs, irq_mask, irq_clear):
    appeared = 1 if fault_flags & ~state.flags else 0
    stopped = 1 if state.running and not running else 0
    now = tripped + 2 * appeared + 4 * setting_refused + 8 * stopped + 16 * motor_differs
    causes = (state.causes & ~irq_clear) | now
    return State(causes, fault_flags, running), (causes, 1 if causes & ~irq_mask else 0)


def stimuli(_rng, _config):
    """Each cause alone, cleared while present and when gone, masked; faults that come while another is present."""
    calm = dict.fromkeys((p.name for p in BLOCK.inputs), 0)
    rows = []
    levels = ({name: 1} for name in ("tripped", "setting_refused", "running", "motor_differs"))
    causes = (*levels, *({"fault_flags": 1 << k} for k in range(15)))
    for cause in causes:
        for clear in (31, 1, 2, 4, 8, 16, 0):
            for mask in (0, clear):
                rows += [calm | cause, calm | cause | {"irq_clear": clear}, calm | {"irq_mask": mask}]
                rows += [calm | cause | {"irq_mask": mask}, calm, calm | {"irq_clear": clear}, calm]
                rows += [calm | {"irq_clear": 31}]
    rows += [calm | {"fault_flags": 1}, calm | {"fault_flags": 1, "irq_clear": 31}, calm | {"fault_flags": 3}]
    return [*rows, calm | {"irq_clear": 31}]


BLOCK = Block(
    name="interrupts",
    folder="io",
    paper="none: interface to software",
    step=step,
    inputs=(
        Port("tripped", BIT, doc="1: a trip is latched"),
        Port("fault_flags", FLAGS, doc="faults since the last clear_trip"),
        Port("setting_refused", BIT, doc="1: dead_time and min_pulse contradict each other"),
        Port("running", BIT, doc="1: gates are switching"),
        Port("motor_differs", BIT, doc="1: the motor is not the one described"),
        Port("irq_mask", CAUSES, doc="bit x: cause x of irq_cause does not raise irq"),
        Port("irq_clear", CAUSES, doc="bit x: clear cause x of irq_cause"),
    ),
    outputs=(
        Port("irq_cause", CAUSES, doc="causes since cleared: trip, fault, setting refused, gates off, motor differs"),
        Port("irq", BIT, doc="1: a cause that is not masked"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
