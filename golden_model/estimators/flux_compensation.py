# SPDX-License-Identifier: BSD-3-Clause
"""The compensation from delta_lambda: the PI of paper 001 eq. (17), or the plain addition of eq. (16).

    integral += flux_ki*delta_lambda       or, while delta_lambda is held, -integral/2**8
    lambda_pi = flux_kp*delta_lambda + integral                         flux_mode 3
    lambda_add = delta_lambda                                           flux_mode 2

All values are limited to +-delta_max.  While delta_lambda is held the integral decays, slowly enough to survive the
few samples of a current step at the voltage limit.  In a longer limitation the merged models give the estimate; at the
speeds where that happens they follow the voltage model.  While the gates are off the integral keeps its value, which a
restart on the fly needs.  Leaving mode 3 clears it.  ``resumes``, the first sample after voltage mode: the integral is
what gives lambda_pi of the sample before once more, limited.

Formats: flux_kp U(7,10), flux_ki U(0,17); products rounded half up to S(1,30), where 2**-17 per unit times the
smallest useful flux_ki still moves the integral; the sum is limited, then rounded half up to FLUX, which cannot exceed
the limit, a multiple of FLUX's LSB.  Saturation: at delta_max, intended; reported by ``compensation_limited``.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.estimators.delta_lambda import DELTA
from golden_model.estimators.flux_models import EARLIER, FLUX_MODE, PROPOSED
from golden_model.fixed import Format, clamp, round_half_up
from golden_model.formats import BIT, FLUX, FLUX_STATE, FLUX_TO_STATE, PU
from golden_model.kernel import kernel

FLUX_KP = Format(0, 7, 10)
FLUX_KI = Format(0, 0, 17)
DELTA_MAX = Format(0, 0, PU.frac_bits)
DROP_P = FLUX.frac_bits + FLUX_KP.frac_bits - FLUX_STATE.frac_bits
DROP_I = FLUX.frac_bits + FLUX_KI.frac_bits - FLUX_STATE.frac_bits
SHIFT_LIMIT = FLUX_STATE.frac_bits - DELTA_MAX.frac_bits
FORGET = 8


class State(NamedTuple):
    integral_d: int = 0  # FLUX_STATE
    integral_q: int = 0


@kernel
def axis(integral, delta, before, held, resumes, mode, kp, ki, limit):
    """One axis: (integral, lambda_pi, lambda_add, 1 if it was limited).

    The earlier scheme has a gain of one and no integral.
    """
    proportional, moved = delta << FLUX_TO_STATE, 0
    if mode == PROPOSED:
        proportional = round_half_up(delta * kp, DROP_P)
        increment = round_half_up(-integral, FORGET) if held else round_half_up(delta * ki, DROP_I)
        sum_ = (before << FLUX_TO_STATE) - proportional if resumes else integral + increment
        moved = clamp(sum_, -limit, limit)
    total = proportional + moved
    result = round_half_up(clamp(total, -limit, limit), FLUX_TO_STATE)
    limited = 1 if abs(total) > limit else 0
    if mode == PROPOSED:
        return moved, result, 0, limited
    if mode == EARLIER:
        return 0, 0, result, limited
    return 0, 0, 0, 0


@kernel
def step(
    state, delta_lambda_d, delta_lambda_q, delta_held, before_d, before_q, resumes, flux_mode, flux_kp, flux_ki,
    delta_max,
):  # fmt: skip
    limit = delta_max << SHIFT_LIMIT
    integral_d, lambda_pi_d, lambda_add_d, limited_d = axis(
        state.integral_d, delta_lambda_d, before_d, delta_held, resumes, flux_mode, flux_kp, flux_ki, limit
    )
    integral_q, lambda_pi_q, lambda_add_q, limited_q = axis(
        state.integral_q, delta_lambda_q, before_q, delta_held, resumes, flux_mode, flux_kp, flux_ki, limit
    )
    outputs = (lambda_pi_d, lambda_pi_q, lambda_add_d, lambda_add_q, limited_d | limited_q)
    return State(integral_d, integral_q), outputs


def reference(v, state):
    limit, out = v["delta_max"], {}
    for x, old in (("d", state.integral_d), ("q", state.integral_q)):
        delta = v[f"delta_lambda_{x}"]
        integral = old * FLUX_STATE.lsb
        integral += -integral * 2.0**-FORGET if v["delta_held"] else v["flux_ki"] * delta
        if v["resumes"]:
            integral = v[f"before_{x}"] - v["flux_kp"] * delta
        total = v["flux_kp"] * delta + min(max(integral, -limit), limit)
        proposed, earlier = v["flux_mode"] == PROPOSED, v["flux_mode"] == EARLIER
        out[f"lambda_pi_{x}"] = min(max(total, -limit), limit) if proposed else 0.0
        out[f"lambda_add_{x}"] = min(max(delta, -limit), limit) if earlier else 0.0
    return out


def bound(_v, _state):
    total = FLUX_STATE.lsb + FLUX.lsb / 2
    return {"lambda_pi_d": total, "lambda_pi_q": total, "lambda_add_d": 0.0, "lambda_add_q": 0.0}


def stimuli(rng, _config):
    """Integrals driven into both limits and back, held, with gains at their ends; every mode in turn; small errors."""
    base = {"flux_mode": PROPOSED, "delta_held": 0, "flux_kp": 8000, "flux_ki": 5000, "delta_max": 8000}
    rows = []
    for delta in (1 << 20, -(1 << 21), 3, -3, FLUX.hi, FLUX.lo, 0):
        rows += [{**base, "delta_lambda_d": delta, "delta_lambda_q": -1 - delta} for _ in range(6)]
    for change in ({"delta_held": 1}, {"delta_max": 65535}, {"delta_max": 0}, {"flux_ki": 131071}):
        rows += [{**rows[k], **change} for k in (0, 8, 20)]
    for mode in (EARLIER, PROPOSED, 0, PROPOSED, 1, EARLIER):
        rows += [{**rows[int(rng.integers(20))], "flux_mode": mode} for _ in range(3)]
    limit = 1 << SHIFT_LIMIT
    for off in (0, *(sign << k for k in range(SHIFT_LIMIT) for sign in (1, -1))):  # the sums at a limit and beside it
        for end in (limit, -limit):
            sums = {"delta_lambda_d": end + off, "delta_lambda_q": off - end, "delta_max": 1}
            rows.append({**base, "delta_max": 0})  # clears the integrals
            rows.append({**base, **sums, "flux_kp": 1 << DROP_P, "flux_ki": 0})
            rows.append({**base, **sums, "flux_kp": 0, "flux_ki": 1 << DROP_I})
    for before in (0, 1 << 18, -(1 << 18), FLUX.hi, FLUX.lo):  # resumed within the limit, at it, beyond it; then moved
        for delta in (0, 99, -77777, FLUX.hi, FLUX.lo):
            row = {**base, "delta_max": 4096, "before_d": before, "before_q": -1 - before}
            row |= {"delta_lambda_d": delta, "delta_lambda_q": -1 - delta}
            rows += [{**row, "resumes": 1}, row]
    for k in range(12):  # between the limits, where every bit of the integrals counts
        gains = {"flux_kp": int(rng.integers(3000)), "flux_ki": int(rng.integers(1, 1 << (k + 4))), "delta_max": 65535}
        for _ in range(24):
            errors = {f"delta_lambda_{x}": int(rng.integers(-(1 << 16), 1 << 16)) for x in "dq"}
            rows.append({**base, **gains, **errors, "delta_held": int(rng.integers(4) == 0)})
    return rows


BLOCK = Block(
    name="flux_compensation",
    folder="estimators",
    paper="001, eq. (17): (K_p + K_i/s)*delta_lambda; the last term of eq. (16)",
    step=step,
    inputs=(
        *DELTA,
        Port("before_d", FLUX, doc="compensation of the sample before, d axis"),
        Port("before_q", FLUX, doc="compensation of the sample before, q axis"),
        Port("resumes", BIT, doc="1: first sample after voltage mode"),
    ),
    registers=(
        FLUX_MODE,
        Port("flux_kp", FLUX_KP, doc="proportional gain of the compensation"),
        Port("flux_ki", FLUX_KI, doc="integral gain of the compensation times the sample time"),
        Port("delta_max", DELTA_MAX, doc="limit of the compensation"),
    ),
    outputs=(
        Port("lambda_pi_d", FLUX, doc="compensation, d axis"),
        Port("lambda_pi_q", FLUX, doc="compensation, q axis"),
        Port("lambda_add_d", FLUX, doc="correction of eq. (16), d axis"),
        Port("lambda_add_q", FLUX, doc="correction of eq. (16), q axis"),
        Port("compensation_limited", BIT, doc="the compensation reached its limit"),
    ),
    state=State(),
    latency=9,
    interval=9,
    constants={"DROP_P": DROP_P, "DROP_I": DROP_I, "SHIFT_LIMIT": SHIFT_LIMIT, "FORGET": FORGET},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
