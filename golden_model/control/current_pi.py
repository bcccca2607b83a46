# SPDX-License-Identifier: BSD-3-Clause
"""Current regulators of both axes.

    err   = i_ref - i
    int  += ki*err      unless the voltage was at its limit and err pushes further
    u_pi  = kp*err + int

``sat_d``, ``sat_q`` (-1, 0, +1) are the limits that were active in voltage_limit in the previous sample.
This delay of one sample keeps the block independent of the limiter; the integral winds up for at most
that sample.  ``run`` = 0: outputs and integrals are zero.

``follows``: int = u_rest, what the voltage of the last sample leaves beside decoupling and compensation, which is R*i
as delta_lambda needs it; an error answers with its proportional part, as after a step of the reference.  With
``by_voltage``, the host's voltage, the proportional part is zero.

Formats: err saturated to PU; proportional part rounded half up to S(9,28), which holds every product; increment
rounded half up to S(1,28), where 2**-16 * ki still counts; integral saturated to S(1,28), twice the largest voltage
the limiter grants, which holds every u_rest; sum exact, rounded half up to PU and saturated, again twice the limiter's.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.fixed import Format, round_half_up, round_sat, saturate
from golden_model.formats import BIT, INTEGRAL, INTEGRAL_W, KI, KP, PU, PU_TO_INTEGRAL, PU_W
from golden_model.kernel import kernel

PROPORTIONAL = Format(1, 9, 28)
PROPORTIONAL_W = PROPORTIONAL.width
DROP_P = PU.frac_bits + KP.frac_bits - PROPORTIONAL.frac_bits
DROP_I = PU.frac_bits + KI.frac_bits - INTEGRAL.frac_bits
SAT = Format(1, 1, 0)


class State(NamedTuple):
    integral_d: int = 0  # INTEGRAL
    integral_q: int = 0


@kernel
def axis(integral, i, i_ref, sat, u_rest, inputs, kp, ki):
    """One axis: (next integral, u_pi); ``inputs`` has run, follows and by_voltage."""
    err = saturate(i_ref - i, PU_W)
    proportional = round_half_up(kp * err, DROP_P)
    moved, _ = multiply_add(ki, err, integral, DROP_I, INTEGRAL_W)
    held = (sat > 0 and err > 0) or (sat < 0 and err < 0)
    if not held:
        integral = moved
    if inputs.by_voltage:
        proportional = 0
    if inputs.follows:
        integral = u_rest << PU_TO_INTEGRAL
    if not inputs.run:
        integral, proportional = 0, 0
    return integral, round_sat(proportional + integral, PU_TO_INTEGRAL, PU_W)


@kernel
def step(state, inputs, regs):
    x, r = inputs, regs
    int_d, u_pi_d = axis(state.integral_d, x.i_d, x.i_d_ref, x.sat_d, x.u_rest_d, x, r.kp_d, r.ki_d)
    int_q, u_pi_q = axis(state.integral_q, x.i_q, x.i_q_ref, x.sat_q, x.u_rest_q, x, r.kp_q, r.ki_q)
    return State(int_d, int_q), (u_pi_d, u_pi_q, int_d, int_q)


def reference(v, state):
    out = {}
    for x, old in (("d", state.integral_d), ("q", state.integral_q)):
        err = PU.limit(v[f"i_{x}_ref"] - v[f"i_{x}"])
        held = v[f"sat_{x}"] * err > 0
        integral = old * INTEGRAL.lsb + (0.0 if held else v[f"ki_{x}"] * err)
        integral = INTEGRAL.limit(integral)
        proportional = 0.0 if v["by_voltage"] else v[f"kp_{x}"] * err
        if v["follows"]:
            integral = v[f"u_rest_{x}"]
        total = proportional + integral
        out[f"u_int_{x}"] = integral if v["run"] else 0.0
        out[f"u_pi_{x}"] = PU.limit(total) if v["run"] else 0.0
    return out


def bound(v, _state):
    inner = INTEGRAL.lsb / 2
    total = PROPORTIONAL.lsb / 2 + inner + PU.lsb / 2
    return {"u_pi_d": total, "u_pi_q": total, "u_int_d": inner, "u_int_q": inner}


def stimuli(rng, _config):
    """Integrals driven into both rails and back, with and without the limiter's word; stop and restart."""
    base = {"kp_d": 40000, "ki_d": 1 << 23, "kp_q": 50000, "ki_q": 1 << 22, "run": 1}
    rows = []
    for ref, sat in ((131071, 0), (131071, 1), (-131072, 1), (-131072, 0), (-131072, -1), (3, 0), (-3, 0)):
        values = {"i_d_ref": ref, "i_q_ref": -1 - ref, "i_d": 0, "i_q": 0, "sat_d": sat, "sat_q": -sat}
        rows += [{**base, **values} for _ in range(8)]
    rows.append({**rows[-1], "run": 0})
    rows += [{**rows[0], "i_d": int(rng.integers(-99, 99))} for _ in range(4)]
    for rest in (0, 777, -777, PU.hi, PU.lo):  # followed with and without a proportional part, then regulated
        for err in (0, 5, -5, PU.hi, PU.lo):
            for by_voltage in (1, 0):
                row = {**base, "u_rest_d": rest, "u_rest_q": -1 - rest, "i_d_ref": err, "i_q_ref": -1 - err}
                rows += [{**row, "follows": 1, "by_voltage": by_voltage}, row, {**row, "by_voltage": by_voltage}]
    return rows


def patient_stimuli(_rng, _config):
    """Errors of a single bit with every word of the limiter: the sign of each has to hold the integral."""
    rows = []
    for bit in range(PU.width - 1):
        for err in (1 << bit, -1 << bit):
            for sat in (1, -1, 0):
                values = {f"i_{x}_ref": err for x in "dq"} | {f"sat_{x}": sat for x in "dq"}
                gains = {"kp_d": 1 << 12, "ki_d": 1 << 20, "kp_q": 1 << 12, "ki_q": 1 << 20}
                rows += [values | gains | {"run": 1}, gains | {"run": 0}]
    return rows


INPUTS = (
    Port("i_d", PU, doc="current, d axis"),
    Port("i_q", PU, late=1, doc="current, q axis"),
    Port("i_d_ref", PU, doc="current reference, d axis"),
    Port("i_q_ref", PU, late=1, doc="current reference, q axis"),
    Port("sat_d", SAT, lo=-1, hi=1, doc="active limit of the last sample, d axis: 1 upper, -1 lower, 0 none"),
    Port("sat_q", SAT, lo=-1, hi=1, doc="active limit of the last sample, q axis: 1 upper, -1 lower, 0 none"),
    Port("u_rest_d", PU, doc="voltage of the last sample without decoupling and compensation, d axis"),
    Port("u_rest_q", PU, doc="voltage of the last sample without decoupling and compensation, q axis"),
    Port("follows", BIT, doc="1: the integrals are loaded from u_rest_d and u_rest_q"),
    Port("by_voltage", BIT, doc="1: no proportional part, the voltage is the host's"),
    Port("run", BIT, doc="0: outputs and integrals zero"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("kp_d", KP, doc="proportional gain, d axis"),
    Port("ki_d", KI, doc="integral gain times sample time, d axis"),
    Port("kp_q", KP, doc="proportional gain, q axis"),
    Port("ki_q", KI, doc="integral gain times sample time, q axis"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="current_pi",
    folder="control",
    paper="001, Fig. 8 and section 5.2: PI_idq",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("u_pi_d", PU, doc="output of the current regulator, d axis"),
        Port("u_pi_q", PU, doc="output of the current regulator, q axis"),
        Port("u_int_d", INTEGRAL, doc="its integral part, d axis"),
        Port("u_int_q", INTEGRAL, doc="its integral part, q axis"),
    ),
    state=State(),
    latency=6,
    soon=("u_pi_d",),
    interval=5,
    constants={"DROP_P": DROP_P, "DROP_I": DROP_I, "PROPORTIONAL_W": PROPORTIONAL_W},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
