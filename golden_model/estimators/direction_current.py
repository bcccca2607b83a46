# SPDX-License-Identifier: BSD-3-Clause
"""The current whose directions are compensated: in position mode the reference.

    towards_alpha = i_d_ref*cos_theta - i_q_ref*sin_theta
    towards_beta  = i_d_ref*sin_theta + i_q_ref*cos_theta           in position mode, else the measured current

A measured current of zero has no direction.  A leg then lacks the compensation that would let its current begin to
flow: until the integral of the current regulator has passed the loss of the legs, several milliseconds, a small
torque is not made, and a shaft at rest drifts.  The reference has its direction at once.  It is not that of the
current where the voltage is at its end, nor while the gates are off.

Formats: references limited to the range of a rotation, 1.375; otherwise those of rotate.
"""

from collections import namedtuple

from golden_model.block import Block, Port
from golden_model.control.current_pi import SAT
from golden_model.fixed import clamp
from golden_model.formats import BIT, PU, VECTOR
from golden_model.kernel import kernel
from golden_model.transforms import rotate


@kernel
def step(inputs, regs):
    x = inputs
    i_d, i_q = clamp(x.i_d_ref, -VECTOR, VECTOR - 1), clamp(x.i_q_ref, -VECTOR, VECTOR - 1)
    alpha, beta = rotate.step(i_d, i_q, x.cos_theta, x.sin_theta)
    if regs.position_mode and x.run and x.sat_d == 0 and x.sat_q == 0:
        return alpha, beta
    return x.i_alpha, x.i_beta


def reference(v, _state):
    if not v["position_mode"] or not v["run"] or v["sat_d"] or v["sat_q"]:
        return {"towards_alpha": v["i_alpha"], "towards_beta": v["i_beta"]}
    i_d, i_q = (min(max(v[name], -VECTOR * PU.lsb), (VECTOR - 1) * PU.lsb) for name in ("i_d_ref", "i_q_ref"))
    c, s = v["cos_theta"], v["sin_theta"]
    return {"towards_alpha": i_d * c - i_q * s, "towards_beta": i_d * s + i_q * c}


def bound(_v, _state):
    return {"towards_alpha": PU.lsb / 2, "towards_beta": PU.lsb / 2}


def stimuli(rng, _config):
    """References at both ends of the range of a rotation and beyond, followed or not."""
    rows = []
    for ref in (0, 1, -1, VECTOR - 1, VECTOR, -VECTOR, -VECTOR - 1, PU.hi, PU.lo):
        for run, sat_d, sat_q in ((1, 0, 0), (0, 0, 0), (1, 1, 0), (1, 0, -1)):
            row = {"i_d_ref": ref, "i_q_ref": int(rng.integers(PU.lo, PU.hi)), "run": run, "sat_d": sat_d}
            row |= {"sat_q": sat_q, "position_mode": 1, "i_alpha": 777, "i_beta": -888}
            rows.append({**row, "cos_theta": 65536, "sin_theta": 0})
    return rows


INPUTS = (
    Port("i_d_ref", PU, doc="current reference, d axis"),
    Port("i_q_ref", PU, doc="current reference, q axis"),
    Port("i_alpha", PU, doc="measured current, alpha"),
    Port("i_beta", PU, doc="measured current, beta"),
    *rotate.TRIG_PORTS,
    Port("sat_d", SAT, doc="voltage at its end, d axis, last sample"),
    Port("sat_q", SAT, doc="voltage at its end, q axis, last sample"),
    Port("run", BIT, doc="1: the gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (Port("position_mode", BIT, doc="1: position control, over speed control"),)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="direction_current",
    folder="estimators",
    paper="none: docs/position.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("towards_alpha", PU, doc="current whose directions are compensated, alpha"),
        Port("towards_beta", PU, doc="current whose directions are compensated, beta"),
    ),
    latency=7,
    interval=7,
    constants={"MOST": VECTOR - 1},
    reference=reference,
    bound=bound,
    possible=rotate.on_circle,
    stimuli=stimuli,
)
