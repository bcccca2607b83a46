# SPDX-License-Identifier: BSD-3-Clause
"""The speed that belongs to the chord of the flux, because the voltage vector is constant during a sample.

    omega_chord = omega_me - k_chord*omega_me**3          k_chord = t_s**2/24

The inverter's voltage vector does not rotate within a period.  In steady state it carries the flux along the
chord from one sample to the next, and the chord of the angle a = omega_me*T_s is 2*sin(a/2), not a:
u = j*(2/T_s)*sin(omega_me*T_s/2)*lambda + R*i.  The decoupling multiplies by this speed; with omega_me the
flux at which the regulators' integrals vanish would be too small by a**2/24, 1 % at half a radian per sample.
The next term of the series is a**4/1920, 3e-5 at half a radian: neglected.

Formats: omega_me**2 U(3,14), k_chord U(-6,23), their product U(-3,20), each half up; the last rounding is to
PU.  A factor of the first two products is raised by 2 and 3 bits, so that all three are cut by the same 20 bits and
pass through one multiplier one after the other.
No saturation: k_chord*omega_me**2 < 1/16, so the result is closer to zero than omega_me and keeps its sign.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up
from golden_model.formats import PU
from golden_model.kernel import kernel

SQUARE = Format(0, 3, 14)
K_CHORD = Format(0, -6, 23)
PART = Format(0, -3, 20)
DROP = PART.frac_bits
RAISE_SQUARE = DROP - (2 * PU.frac_bits - SQUARE.frac_bits)
RAISE_PART = DROP - (SQUARE.frac_bits + K_CHORD.frac_bits - PART.frac_bits)


@kernel
def step(omega_me, k_chord):
    square = round_half_up((omega_me << RAISE_SQUARE) * omega_me, DROP)
    part = round_half_up((square << RAISE_PART) * k_chord, DROP)
    shorter = round_half_up(part * omega_me, DROP)
    return (omega_me - shorter,)


def reference(v, _state):
    return {"omega_chord": v["omega_me"] - v["k_chord"] * v["omega_me"] ** 3}


def bound(v, _state):
    part = v["k_chord"] * SQUARE.lsb / 2 + PART.lsb / 2
    return {"omega_chord": abs(v["omega_me"]) * part + PU.lsb / 2}


BLOCK = Block(
    name="chord_speed",
    folder="control",
    paper="001, eq. (2), for a voltage that is held during a sample",
    step=step,
    inputs=(Port("omega_me", PU, doc="electrical speed"),),
    registers=(Port("k_chord", K_CHORD, doc="(sample time)**2 / 24, per unit"),),
    outputs=(Port("omega_chord", PU, doc="electrical speed along the chord of a sample"),),
    latency=10,
    interval=10,
    constants={"RAISE_SQUARE": RAISE_SQUARE, "RAISE_PART": RAISE_PART, "DROP": DROP},
    reference=reference,
    bound=bound,
)
