# SPDX-License-Identifier: BSD-3-Clause
"""Resolver or encoder code to electrical angle: theta_me = pole_pairs * code + theta_offset, modulo one turn.

``pole_pairs`` are electrical turns in a turn of the code: the motor's pole pairs over those of a resolver.

Formats: a code of 8 to 18 bits is left-aligned in 18 bits.  Nothing is rounded; every operation is
modulo one turn, because angles wrap.  ``reverse`` = 1 inverts the sense of rotation (code -> -code).
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, wrap
from golden_model.formats import BIT, TURN, TURN_W
from golden_model.kernel import kernel

POLE_PAIRS = Format(0, 6, 0)


@kernel
def step(code_theta, reverse, pole_pairs, theta_offset, position_bits):
    prod = pole_pairs * code_theta
    turn = prod << (TURN_W - position_bits)
    theta_me = wrap(theta_offset - turn if reverse else theta_offset + turn, TURN_W)
    return (theta_me,)


def reference(v, _state):
    mech = -v["code_theta"] if v["reverse"] else v["code_theta"]
    return {"theta_me": (mech * v["pole_pairs"] + v["theta_offset"]) % 1.0}


def bound(_v, _state):
    return {"theta_me": 0.0}


def stimuli(_rng, config):
    """Both ends of the code around the wrap, both directions, one to 63 pole pairs."""
    top = (1 << config["POSITION_BITS"]) - 1
    return [
        {"code_theta": code, "reverse": rev, "pole_pairs": p, "theta_offset": off}
        for code in (0, 1, top, top - 1, top // 2, top // 2 + 1)
        for rev in (0, 1)
        for p in (1, 4, 63)
        for off in (0, 1, TURN.hi)
    ]


def code_format(config):
    return Format(0, 0, config["POSITION_BITS"])


BLOCK = Block(
    name="position",
    folder="io",
    paper="001, section 5.2, position",
    step=step,
    inputs=(Port("code_theta", Format(0, 0, 16), doc="position code, one mechanical turn"),),
    registers=(
        Port("reverse", BIT, doc="1: code counts opposite to the phase order"),
        Port("pole_pairs", POLE_PAIRS, lo=1, doc="electrical turns in a turn of the code"),
        Port("theta_offset", TURN, doc="electrical angle at code zero"),
    ),
    outputs=(Port("theta_me", TURN, doc="electrical angle"),),
    latency=2,
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
