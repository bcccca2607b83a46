# SPDX-License-Identifier: BSD-3-Clause
"""Whether the host still writes: no write for ``heartbeat`` sample times is a fault; runs at every clock.

    age = sample times (``period``) since the last write, counted up to heartbeat
    host_lost = 1 from heartbeat periods after the last write until the next one;  heartbeat = 0: never

Any write that the registers accept counts.  The age is counted up to heartbeat only, so that it cannot wrap.
Formats: sample times.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

PERIODS = Format(0, 16, 0)


class State(NamedTuple):
    age: int = 0


@kernel
def step(state, host_write, period, heartbeat):
    expired = state.age >= heartbeat
    age = 0 if host_write else (state.age + 1 if period and not expired else state.age)
    lost = 1 if expired and heartbeat != 0 and not host_write else 0
    return State(age), (lost,)


def stimuli(_rng, _config):
    """Writes just in time and just too late, with and without a period in the same clock; the limit rewritten, zero."""
    rows = []
    for heartbeat in (0, 1, 2, 7):
        for write in (heartbeat - 1, heartbeat, heartbeat + 1, heartbeat + 3):
            rows.append({"host_write": 1, "period": 0, "heartbeat": heartbeat})
            for k in range(heartbeat + 5):
                rows += [{"host_write": 0, "period": 0, "heartbeat": heartbeat}] * 2
                rows.append({"host_write": int(k == write), "period": 1, "heartbeat": heartbeat})
    rows += [{"host_write": 0, "period": 1, "heartbeat": h} for h in (PERIODS.hi, 3, 0, 3, 9) for _ in range(12)]
    return rows


def patient_stimuli(_rng, _config):
    """The longest times that a bit of the age makes, met and missed by one, in a period each clock."""
    rows = []
    for bit in range(8, PERIODS.width + 1):
        longest = (1 << bit) - 1
        rows.append({"host_write": 1, "period": 0, "heartbeat": longest})
        rows += [{"host_write": 0, "period": 1, "heartbeat": longest}] * (longest + 3)
    return rows


BLOCK = Block(
    name="host_watch",
    folder="io",
    paper="none: protection of the drive",
    step=step,
    inputs=(
        Port("host_write", BIT, doc="1: the host has written a register"),
        Port("period", BIT, doc="1: a PWM period begins"),
    ),
    registers=(Port("heartbeat", PERIODS, doc="longest time without a write, sample times; 0: no limit"),),
    outputs=(Port("host_lost", BIT, doc="1: the last write is older than heartbeat periods"),),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
