# SPDX-License-Identifier: BSD-3-Clause
"""1/omega_me for delta_lambda, fading out towards standstill: no divider in the sample path.

    factor * 2**n = weight/omega_me
    weight = limit((|omega_me| - omega_min)*k_ramp, 0, 1)

Paper 001, section 5.2: within +-2 rad/s no compensation is calculated.  With a plain threshold delta_lambda would
jump there by the error of the estimate.  The weight reduces it to zero along a ramp of 1/k_ramp above omega_min, so
it is continuous at every speed and zero from -omega_min to omega_min.

Formats: reciprocal as in common/reciprocal, |omega_me| from 2**-12 on; weight U(1,16), half up; factor signed, 17
fraction bits, half up: m*weight <= m < 1, so it fits.  |omega_me| = 2 is replaced by the next smaller number.
"""

from golden_model.block import Block, Port
from golden_model.common import reciprocal
from golden_model.fixed import Format, clamp, round_half_up
from golden_model.formats import DUTY, PU, RECIPROCAL, U_DC
from golden_model.kernel import kernel

N_MAX = 12
K_RAMP = Format(0, 12, 4)
FACTOR = Format(1, 0, RECIPROCAL.frac_bits)
WEIGHT_ONE = 1 << DUTY.frac_bits
DROP_WEIGHT = PU.frac_bits + K_RAMP.frac_bits - DUTY.frac_bits
DROP_FACTOR = DUTY.frac_bits
MAGNITUDE_MAX = U_DC.hi


@kernel
def step(omega_me, omega_min, k_ramp):
    magnitude = min(abs(omega_me), MAGNITUDE_MAX)
    m, n, _low = reciprocal.step(magnitude, N_MAX)
    above = magnitude - omega_min
    weight = clamp(round_half_up(above * k_ramp, DROP_WEIGHT), 0, WEIGHT_ONE)
    factor = round_half_up(m * weight, DROP_FACTOR)
    return (-factor if omega_me < 0 else factor), n


def reference(v, _state):
    magnitude = min(abs(v["omega_me"]), MAGNITUDE_MAX * U_DC.lsb)
    used = max(magnitude, 2.0**-N_MAX)
    mantissa = used * 2.0 ** int(reciprocal.step(max(1, round(used * 2**16)), N_MAX)[1])
    weight = min(max((magnitude - v["omega_min"]) * v["k_ramp"], 0.0), 1.0)
    sign = -1.0 if v["omega_me"] < 0 else 1.0
    return {"factor": sign * weight / mantissa}


def bound(_v, _state):
    """Errors of m (one LSB) and of the weight (half an LSB of 2**-16), and the rounding of the product."""
    return {"factor": RECIPROCAL.lsb + DUTY.lsb / 2 + FACTOR.lsb / 2}


def stimuli(_rng, _config):
    """Through zero in both directions, the ramp's ends and their neighbours, both ends of the speed."""
    rows = []
    for omega_min, k_ramp in ((417, 157 * 16), (16, 4095 * 16), (0, 1), (131071, 65535)):
        for omega in (0, 1, 15, 16, 17, 32, 33, 416, 417, 418, 600, 833, 834, 835, 40000, PU.hi, PU.hi + 1):
            rows += [{"omega_me": s, "omega_min": omega_min, "k_ramp": k_ramp} for s in (-omega, min(omega, PU.hi))]
    return rows


OUTPUTS = (
    Port("factor", FACTOR, lo=-FACTOR.hi, doc="mantissa of weight/omega_me"),
    Port("n_omega", reciprocal.SHIFT, hi=N_MAX, doc="exponent of 1/omega_me"),
)

BLOCK = Block(
    name="speed_reciprocal",
    folder="estimators",
    paper="001, section 5.2: lower limit of the speed for delta_lambda",
    step=step,
    inputs=(Port("omega_me", PU, doc="electrical speed"),),
    registers=(
        Port("omega_min", Format(0, 1, 16), doc="no compensation up to this speed"),
        Port("k_ramp", K_RAMP, doc="compensation fades in over 1/k_ramp above omega_min"),
    ),
    outputs=OUTPUTS,
    latency=reciprocal.BLOCK.latency + 3,
    interval=reciprocal.BLOCK.latency + 3,
    constants={
        "N_MAX": N_MAX,
        "DROP_WEIGHT": DROP_WEIGHT,
        "DROP_FACTOR": DROP_FACTOR,
        "WEIGHT_ONE": WEIGHT_ONE,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
