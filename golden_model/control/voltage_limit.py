# SPDX-License-Identifier: BSD-3-Clause
"""Adds decoupling and dead-time compensation and keeps the voltage inside the circle of radius u_max, d axis first.

    limit = min(u_max, room),  u_d = limit(u_pi_d + u_dec_d + u_comp_d, +-limit)
    u_q = limit(u_pi_q + u_dec_q + u_comp_q, +-sqrt(u_max**2 - u_d**2))
    room = sqrt(u_max**2 - min(|u_dec_q|, u_max)**2)        for the next sample;  u_max where lambda_d < 0 and sat_d = 1
    sat_x = -1, 0, +1: the active limit of the axis, for the anti-windup of the regulator

Room: the d axis has priority, but only within the voltage that remains beside the EMF of the last sample.  Without
this the drive has a second stable point near the voltage limit, reached by a disturbance or a bus sag: u_d at its
limit, no voltage for u_q, hence little flux, hence i_d far below its reference, hence u_d at its limit, braking with
more than the rated current.  With it the q axis can always balance its EMF; below the limit nothing changes.
With lambda_d < 0 and u_d at its upper end i_d is too low, weakened too far, and the EMF drives i_q towards zero, which
is what frees voltage for u_d: a q axis that balances it would hold i_q, and u_d would lack the voltage that brings i_d
back, the more the further i_d runs away.

Radicands are formed as (u_max - u)*(u_max + u): exact, U(0,32), both factors below 2.  The root is never
above the true one, so the circle is never left.
"""

import math
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common import sqrt
from golden_model.control.current_pi import SAT
from golden_model.fixed import clamp
from golden_model.formats import PU, U_MAX
from golden_model.kernel import kernel


@kernel
def side(value, limit):
    """+1 above the limit, -1 below its negative, 0 between."""
    return 1 if value > limit else (-1 if value < -limit else 0)


class State(NamedTuple):
    room: int = U_MAX.hi  # largest u_d that leaves enough voltage for the EMF


@kernel
def step(state, u_pi_d, u_pi_q, u_dec_d, u_dec_q, u_comp_d, u_comp_q, u_max, lambda_d):
    sum_d = u_pi_d + u_dec_d + u_comp_d
    sum_q = u_pi_q + u_dec_q + u_comp_q
    limit_d = min(u_max, state.room)
    sat_d = side(sum_d, limit_d)
    u_d = clamp(sum_d, -limit_d, limit_d)
    (u_q_max,) = sqrt.step((u_max - u_d) * (u_max + u_d))
    sat_q = side(sum_q, u_q_max)
    u_q = clamp(sum_q, -u_q_max, u_q_max)
    emf = min(abs(u_dec_q), u_max) if lambda_d >= 0 or sat_d <= 0 else 0
    (room,) = sqrt.step((u_max - emf) * (u_max + emf))
    return State(room), (u_d, u_q, sat_d, sat_q)


def limited_d(v, state):
    """u_d in real numbers: exact, so that only q needs a bound."""
    limit = min(v["u_max"], state.room * U_MAX.lsb)
    return min(max(v["u_pi_d"] + v["u_dec_d"] + v["u_comp_d"], -limit), limit)


def reference(v, state):
    u_d = limited_d(v, state)
    u_q_max = math.sqrt(max(0.0, v["u_max"] ** 2 - u_d**2))
    return {"u_d": u_d, "u_q": min(max(v["u_pi_q"] + v["u_dec_q"] + v["u_comp_q"], -u_q_max), u_q_max)}


def bound(v, state):
    """d is exact; q carries the root's error, see sqrt."""
    radicand = max(0.0, v["u_max"] ** 2 - limited_d(v, state) ** 2)
    return {"u_d": 0.0, "u_q": sqrt.bound({"x": radicand}, None)["root"]}


def stimuli(_rng, _config):
    """On the circle, one LSB inside and outside, both axes, all signs, EMF up to the full radius; radius zero."""
    rows = []
    for u_max in (0, 1, 2, 20000, 37900, 65535):
        for d in (0, u_max - 1, u_max, u_max + 1, u_max * 3 // 5):
            for q in (0, u_max * 4 // 5 - 1, u_max * 4 // 5 + 1, 131071):
                for s in (1, -1):
                    rest = dict.fromkeys(("u_dec_d", "u_dec_q", "u_comp_d", "u_comp_q"), 0)
                    rows.append({"u_pi_d": s * d, "u_pi_q": -s * q, **rest, "u_max": u_max})
    for u_max, lambda_d in ((30000, 0), (30000, -1), (30000, 1), (65535, -131072)):  # the room with and without its EMF
        for emf in (u_max - 1, -u_max, u_max // 2):
            rest = dict.fromkeys(("u_dec_d", "u_pi_q", "u_comp_d", "u_comp_q"), 0)
            row = {**rest, "u_dec_q": emf, "u_max": u_max, "lambda_d": lambda_d}
            rows += [{**row, "u_pi_d": 70000}, {**row, "u_pi_d": -70000}]
    return rows


BLOCK = Block(
    name="voltage_limit",
    folder="control",
    paper="001, Fig. 1: decoupling at the regulators' output; limit of the space-vector modulation",
    step=step,
    inputs=(
        Port("u_pi_d", PU, doc="output of the current regulator, d axis"),
        Port("u_pi_q", PU, late=1, doc="output of the current regulator, q axis"),
        Port("u_dec_d", PU, doc="rotational voltage, d axis"),
        Port("u_dec_q", PU, late=1, doc="rotational voltage, q axis"),
        Port("u_comp_d", PU, doc="compensation voltage, d axis"),
        Port("u_comp_q", PU, late=1, doc="compensation voltage, q axis"),
        Port("u_max", U_MAX, doc="radius of the voltage circle"),
        Port("lambda_d", PU, doc="flux linkage, d axis"),
    ),
    outputs=(
        Port("u_d", PU, doc="voltage, d axis"),
        Port("u_q", PU, doc="voltage, q axis"),
        Port("sat_d", SAT, lo=-1, hi=1, doc="active limit, d axis: 1 upper, -1 lower, 0 none"),
        Port("sat_q", SAT, lo=-1, hi=1, doc="active limit, q axis: 1 upper, -1 lower, 0 none"),
    ),
    state=State(),
    latency=5 + sqrt.BLOCK.latency,
    interval=6 + sqrt.BLOCK.latency,
    soon=("u_d",),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
