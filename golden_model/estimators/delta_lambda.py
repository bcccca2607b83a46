# SPDX-License-Identifier: BSD-3-Clause
"""The error of the flux estimate, from the integrals of the current regulators: paper 001 eq. (15).

    delta_lambda_d =  (u_int_q - r*i_q - left_q) / omega_me
    delta_lambda_q = -(u_int_d - r*i_d - left_d) / omega_me        1/omega_me as factor * 2**n
    left = u_int - r*i while held, then less by 1/128 a sample

When the decoupling uses the estimate, the integrals contain only the resistive drop and omega_me times the error of
the estimate.  u_int is taken from two samples before: the voltage commanded at one sample acts in the next period
and changes the currents at its end.  With the regulator's zero on the pole of the winding, R*i(k) = u_int(k-2) is
valid during every step of the reference, not only in steady state.

Held while the integrals contain other voltages: voltage at its limit (sat_d, sat_q), a current converter at its end,
bus reading lost.  While held, delta_lambda decays by a sixteenth per sample, and ``delta_held`` makes the integral in
flux_compensation decay too: otherwise a wrong estimate that drives the voltage to its limit would persist.  What the
hold has left in the integrals is no flux error, and flux_compensation would answer it with ten times as much: ``left``
takes it off and fades, about as fast as the winding's L/r takes it out of the integrals.  Zero while the gates are off.

Formats: r*i rounded half up to 28 fraction bits; differences exact; shifted by n, rounded half up and saturated to
FLUX; times factor, rounded half up; the decays likewise.  Saturation at 2 per unit of flux, more than the machine can
have, but reached at low speed by a small voltage error; reported by ``delta_limited`` unless the weight is zero.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.control.current_pi import SAT
from golden_model.estimators import speed_reciprocal
from golden_model.estimators.winding_resistance import R
from golden_model.fixed import Format, exceeds, round_half_up, saturate
from golden_model.formats import BIT, FLUX, FLUX_W, INTEGRAL, PU, RESISTANCE
from golden_model.kernel import kernel

DROP_R = PU.frac_bits + RESISTANCE.frac_bits - INTEGRAL.frac_bits
DROP_SHIFTED = INTEGRAL.frac_bits - FLUX.frac_bits
DROP_FACTOR = speed_reciprocal.FACTOR.frac_bits
FADE = 4
FORGET = 7


class State(NamedTuple):
    delta_d: int = 0  # FLUX
    delta_q: int = 0
    u_int_d_1: int = 0  # INTEGRAL, of the last sample
    u_int_q_1: int = 0
    u_int_d_2: int = 0  # of the sample before
    u_int_q_2: int = 0
    left_d: int = 0  # as u_int - r*i: what a hold has left in the integral
    left_q: int = 0


@kernel
def axis(u_int, i, left, factor, n, r):
    """One axis: (delta, 1 if it was limited, u_int - r*i)."""
    rest = u_int - round_half_up(r * i, DROP_R)
    shifted = (rest - left) << n
    rounded = round_half_up(shifted, DROP_SHIFTED)
    value, limited = saturate(rounded, FLUX_W), exceeds(rounded, FLUX_W)
    delta = round_half_up(value * factor, DROP_FACTOR)  # |factor| < 1, so it fits
    return delta, limited if factor != 0 else 0, rest


@kernel
def step(state, inputs):
    x = inputs
    delta_d, limited_d, rest_q = axis(state.u_int_q_2, x.i_q, state.left_q, x.factor, x.n_omega, x.r)
    delta_q, limited_q, rest_d = axis(state.u_int_d_2, x.i_d, state.left_d, -x.factor, x.n_omega, x.r)
    left_d = state.left_d - round_half_up(state.left_d, FORGET)
    left_q = state.left_q - round_half_up(state.left_q, FORGET)
    limited = limited_d | limited_q
    held = 1 if x.run and (x.sat_d != 0 or x.sat_q != 0 or x.current_at_rail != 0 or not x.voltage_known) else 0
    if held:
        delta_d = state.delta_d - round_half_up(state.delta_d, FADE)
        delta_q = state.delta_q - round_half_up(state.delta_q, FADE)
        left_d, left_q, limited = rest_d, rest_q, 0
    if not x.run:
        delta_d, delta_q, left_d, left_q, limited = 0, 0, 0, 0, 0
    state = State(delta_d, delta_q, x.u_int_d, x.u_int_q, state.u_int_d_1, state.u_int_q_1, left_d, left_q)
    return state, (delta_d, delta_q, held, limited)


def reference(v, state):
    if not v["run"]:
        return {"delta_lambda_d": 0.0, "delta_lambda_q": 0.0}
    if v["sat_d"] or v["sat_q"] or v["current_at_rail"] or not v["voltage_known"]:
        left = (1.0 - 2.0**-FADE) * FLUX.lsb
        return {"delta_lambda_d": state.delta_d * left, "delta_lambda_q": state.delta_q * left}
    out = {}
    rows = (("d", state.u_int_q_2 - state.left_q, v["i_q"], 1), ("q", state.u_int_d_2 - state.left_d, v["i_d"], -1))
    for x, u_int, i, sign in rows:
        rest = u_int * INTEGRAL.lsb - v["r"] * i
        scaled = FLUX.limit(rest * 2.0 ** v["n_omega"])
        out[f"delta_lambda_{x}"] = FLUX.limit(scaled * sign * v["factor"])
    return out


def bound(v, _state):
    """Rounding of the drop times 2**n and of the shifted value, both times the factor; then of the output."""
    scaled = 2.0 ** v["n_omega"] * INTEGRAL.lsb / 2 + FLUX.lsb
    return dict.fromkeys(("delta_lambda_d", "delta_lambda_q"), scaled * abs(v["factor"]) + FLUX.lsb)


def stimuli(rng, _config):
    """Small differences at every exponent, both signs of the speed, ties, range ends; held, stopped, restarted."""
    calm = {"sat_d": 0, "sat_q": 0, "current_at_rail": 0, "voltage_known": 1, "run": 1, "r": 641000}
    rows = []
    for n in range(speed_reciprocal.N_MAX + 1):
        for factor in (131071, -131071, 70000, -1, 0):
            signals = {k: int(rng.integers(-(1 << 17), 1 << 17)) for k in ("u_int_d", "u_int_q")}
            rows.append({**calm, **signals, "i_d": 7, "i_q": -900, "factor": factor, "n_omega": n})
    for change in ({"sat_d": 1}, {"sat_q": -1}, {"current_at_rail": 4}, {"voltage_known": 0}, {"run": 0}, {}):
        rows += [{**rows[20], **change}, {**rows[24], **change}]
    still = {**calm, "i_d": 0, "i_q": 0, "factor": 131071}
    for n in (0, 3, 12):
        for end in (1 << (29 - n), -(1 << (29 - n))):
            for off in (-33, -17, -16, -15, -1, 0, 1, 15, 16, 17, 33):
                near = [max(min(x, INTEGRAL.hi), INTEGRAL.lo) for x in (end + off, end - off)]
                rows.append({**still, "u_int_d": near[0], "u_int_q": near[1], "n_omega": n})
    for big in (INTEGRAL.hi, INTEGRAL.lo, 200, -70, 1 << 20):  # what a hold leaves, both axes, fading
        ends = {"u_int_d": big, "u_int_q": -1 - big, "i_d": 1 << 15, "i_q": -5000, "n_omega": 1}
        rows += [{**still, **ends, "sat_d": k % 2, "sat_q": 1 - k % 2} for k in range(4)]
        rows += [{**still, **ends, "u_int_d": big // 2, "factor": 90000} for _ in range(12)]
    rows.append({**still, "u_int_d": 0, "u_int_q": 0, "n_omega": 0, "run": 0})
    for factor in (65536, -65536):
        rows += [{**still, "u_int_d": 32 * k, "u_int_q": -32 * k, "factor": factor, "n_omega": 0} for k in range(-5, 6)]
    return rows


DELTA = (
    Port("delta_lambda_d", FLUX, doc="flux linkage missing in the estimate, d axis"),
    Port("delta_lambda_q", FLUX, doc="flux linkage missing in the estimate, q axis"),
    Port("delta_held", BIT, doc="1: held, the integrals do not show the flux error"),
)

INPUTS = (
    Port("u_int_d", INTEGRAL, doc="integral part of the regulator, d axis"),
    Port("u_int_q", INTEGRAL, doc="integral part of the regulator, q axis"),
    Port("i_d", PU, doc="current, d axis"),
    Port("i_q", PU, doc="current, q axis"),
    Port("sat_d", SAT, lo=-1, hi=1, doc="active limit, d axis: 1 upper, -1 lower, 0 none"),
    Port("sat_q", SAT, lo=-1, hi=1, doc="active limit, q axis: 1 upper, -1 lower, 0 none"),
    Port("current_at_rail", Format(0, 3, 0), doc="bit x: ADC code of phase x at either end"),
    Port("voltage_known", BIT, doc="0: gates off or bus reading lost"),
    Port("run", BIT, doc="1: the gates are switching"),
    *speed_reciprocal.OUTPUTS,
    R,
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])

BLOCK = Block(
    name="delta_lambda",
    folder="estimators",
    paper="001, eq. (15); 'delta lambda_dq' of Fig. 8",
    step=step,
    takes=(Inputs,),
    inputs=INPUTS,
    outputs=(*DELTA, Port("delta_limited", BIT, doc="delta lambda reached its range")),
    state=State(),
    latency=12,
    interval=12,
    constants={
        "DROP_R": DROP_R,
        "DROP_SHIFTED": DROP_SHIFTED,
        "DROP_FACTOR": DROP_FACTOR,
        "FADE": FADE,
        "FORGET": FORGET,
        "N_MAX": speed_reciprocal.N_MAX,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
