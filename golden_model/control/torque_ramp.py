# SPDX-License-Identifier: BSD-3-Clause
"""The torque reference with a limited change per sample, so that both currents move along the curves of the table.

    torque_now moves to torque_ref by torque_step in a sample at most; zero with ``run`` = 0

Formats: PU.  Rounding: none.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import clamp
from golden_model.formats import BIT, PU
from golden_model.kernel import kernel


class State(NamedTuple):
    torque_now: int = 0  # PU


@kernel
def step(state, torque_ref, run, torque_step):
    torque_now = clamp(torque_ref, state.torque_now - torque_step, state.torque_now + torque_step)
    if not run:
        torque_now = 0
    return State(torque_now), (torque_now,)


def reference(v, state):
    now = state.torque_now * PU.lsb
    moved = min(max(v["torque_ref"], now - v["torque_step"]), now + v["torque_step"])
    return {"torque_now": moved if v["run"] else 0.0}


def bound(_v, _state):
    return {"torque_now": 0.0}


BLOCK = Block(
    name="torque_ramp",
    folder="control",
    paper="none: docs/speed_range.md",
    step=step,
    inputs=(
        Port("torque_ref", PU, doc="torque reference: output of the speed regulator or from the host"),
        Port("run", BIT, doc="1: the gates are switching"),
    ),
    registers=(Port("torque_step", PU, lo=0, doc="largest change of the torque reference per sample"),),
    outputs=(Port("torque_now", PU, doc="torque reference of this sample"),),
    state=State(),
    latency=1,
    reference=reference,
    bound=bound,
)
