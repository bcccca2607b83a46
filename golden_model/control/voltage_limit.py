"""Adds the decoupling and keeps the voltage inside the circle of radius u_max, d axis first.

    u_d = limit(u_pi_d + u_dec_d, +-u_max)
    u_q = limit(u_pi_q + u_dec_q, +-sqrt(u_max**2 - u_d**2))
    sat_x = -1, 0, +1: the limit that holds the axis, for the regulator's integral

The radicand is formed as (u_max - u)*(u_max + u); a negative factor tells that d is at its limit, and
on which side.  Formats: sums exact; radicand exact, U(0,32), since both factors are below 2 when
neither is negative; the root never above the true one, so the circle is never left.
"""

import math

from golden_model.block import Block, Port
from golden_model.common import sqrt
from golden_model.fixed import clamp
from golden_model.formats import PU, U_MAX
from golden_model.kernel import kernel
from golden_model.control.current_pi import SAT


@kernel
def side(value, limit):
    """+1 above the limit, -1 below its negative, 0 between."""
    return 1 if value > limit else (-1 if value < -limit else 0)


@kernel
def step(u_pi_d, u_pi_q, u_dec_d, u_dec_q, u_max):
    sum_d = u_pi_d + u_dec_d
    sum_q = u_pi_q + u_dec_q
    sat_d = side(sum_d, u_max)
    u_d = clamp(sum_d, -u_max, u_max)
    radicand = 0 if sat_d != 0 else (u_max - sum_d) * (u_max + sum_d)
    (u_q_max,) = sqrt.step(radicand)
    sat_q = side(sum_q, u_q_max)
    u_q = clamp(sum_q, -u_q_max, u_q_max)
    return u_d, u_q, sat_d, sat_q


def reference(v, _state):
    u_max = v["u_max"]
    u_d = min(max(v["u_pi_d"] + v["u_dec_d"], -u_max), u_max)
    u_q_max = math.sqrt(max(0.0, u_max**2 - u_d**2))
    return {"u_d": u_d, "u_q": min(max(v["u_pi_q"] + v["u_dec_q"], -u_q_max), u_q_max)}


def bound(v, _state):
    """d is exact; q carries the root's error, see sqrt."""
    u_d = min(max(v["u_pi_d"] + v["u_dec_d"], -v["u_max"]), v["u_max"])
    return {"u_d": 0.0, **{"u_q": sqrt.bound({"x": max(0.0, v["u_max"] ** 2 - u_d**2)}, None)["root"]}}


def stimuli(_rng, _config):
    """On the circle, one LSB inside and outside it, both axes, all signs; a circle of radius zero."""
    rows = []
    for u_max in (0, 1, 2, 20000, 37900, 65535):
        for d in (0, u_max - 1, u_max, u_max + 1, u_max * 3 // 5):
            for q in (0, u_max * 4 // 5 - 1, u_max * 4 // 5 + 1, 131071):
                for s in (1, -1):
                    rows.append(
                        {"u_pi_d": s * d, "u_pi_q": -s * q, "u_dec_d": 0, "u_dec_q": 0, "u_max": u_max}
                    )
    return rows


BLOCK = Block(
    name="voltage_limit",
    folder="control",
    paper="001, Fig. 1: decoupling at the regulators' output; limit of the space-vector modulation",
    step=step,
    inputs=(
        Port("u_pi_d", PU, doc="regulator output, d axis"),
        Port("u_pi_q", PU, doc="regulator output, q axis"),
        Port("u_dec_d", PU, doc="rotational voltage, d axis"),
        Port("u_dec_q", PU, doc="rotational voltage, q axis"),
        Port("u_max", U_MAX, doc="radius of the voltage circle"),
    ),
    outputs=(
        Port("u_d", PU, doc="voltage, d axis"),
        Port("u_q", PU, doc="voltage, q axis"),
        Port("sat_d", SAT, lo=-1, hi=1, doc="limit that holds the d axis"),
        Port("sat_q", SAT, lo=-1, hi=1, doc="limit that holds the q axis"),
    ),
    latency=4 + sqrt.BLOCK.latency,
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
