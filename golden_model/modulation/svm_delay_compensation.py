# SPDX-License-Identifier: BSD-3-Clause
"""Angle at which the voltage will act: theta_out = theta_me + k_delay*omega_me, modulo one turn.

A duty computed from the samples of one period acts during the next, on average 1.5 sample times after
the sampling instant: k_delay = 1.5*T_s*omega_base/(2*pi) turns.  Advancing the angle of the inverse
Park transform rotates the voltage vector.

Formats: product 33 fraction bits, rounded half up to TURN; the sum wraps, it is an angle.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up, wrap
from golden_model.formats import PU, TURN, TURN_W
from golden_model.kernel import kernel

K_DELAY = Format(0, 0, 17)
DROP = PU.frac_bits + K_DELAY.frac_bits - TURN.frac_bits


@kernel
def step(theta_me, omega_me, k_delay):
    prod = omega_me * k_delay
    theta_out = wrap(theta_me + round_half_up(prod, DROP), TURN_W)
    return (theta_out,)


def reference(v, _state):
    return {"theta_out": (v["theta_me"] + v["k_delay"] * v["omega_me"]) % 1.0}


def bound(_v, _state):
    return {"theta_out": TURN.lsb / 2}


BLOCK = Block(
    name="svm_delay_compensation",
    folder="modulation",
    paper="001, section 5.2, SVM delay compensation",
    step=step,
    inputs=(Port("theta_me", TURN, doc="electrical angle"), Port("omega_me", PU, doc="electrical speed")),
    registers=(Port("k_delay", K_DELAY, doc="angle of the delay in turns, per unit of speed"),),
    outputs=(Port("theta_out", TURN, doc="electrical angle when the voltage acts"),),
    latency=3,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
)
