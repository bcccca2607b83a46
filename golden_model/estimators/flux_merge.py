# SPDX-License-Identifier: BSD-3-Clause
"""Merge of the voltage and current models in the stator frame: paper 001 eq. (7), without a pure integrator.

Continuous, with the error eps = lambda_c - lambda of the current model against the merged flux:

    d(lambda)/dt = u - R*i + 2*xi*omega_0*eps + x          d(x)/dt = omega_0**2 * eps

which is (7) exactly: with N = 2*xi*omega_0*s + omega_0**2, lambda = (s**2*lambda_v + N*lambda_c)/(s**2 + N).
Per sample and axis, with w = omega_0*T_s, rho = R*T_s/2 (docs/flux_estimator.md derives it and its poles):

    lambda      = lambda_m - rho*i             the flux at this sample; lambda_m is from the last sample
    eps         = lambda_c - lambda
    y           = w*eps
    x          += w*y
    lambda_m    = lambda + 2*xi*y + x          corrected ...
                  + t_s*u_applied - rho*i      ... and integrated to the next sample, without its resistive drop

The flux balance over a period is exact for the voltage and uses the mean of the currents at both ends.  The drop of
the current at the end of the period is subtracted one sample later, here and in flux_models.
If the voltage of the last period is unknown (gates off, bus reading lost), the current model replaces the merge:
lambda = lambda_c, x = 0.

Formats: lambda S(1,30), eps and u FLUX, y S(-1,25), x S(-3,36); all products exact, each rounded half up.
Stall: y rounds to zero below eps = 2**-26/w, x below y = 2**-37/w: less than one LSB of lambda_dq for
w >= 2**-10 (docs, word lengths).
Saturation: lambda and eps at 2 per unit of flux, x at 1/8 per unit per sample, a voltage error of 1/(8*t_s) per
unit; not reached by a drive within its bases.  ``merge_limited`` reports it, and the filter recovers with its own
time constant.  y needs none: |eps| <= 2 and w < 1/4.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.estimators.winding_resistance import RHO, T_S
from golden_model.fixed import Format, exceeds, round_half_up, round_sat, saturate
from golden_model.formats import (
    BIT,
    FLUX,
    FLUX_STATE,
    FLUX_STATE_W,
    FLUX_TO_STATE,
    FLUX_W,
    PU,
    RESISTANCE,
    SAMPLE_TIME,
)
from golden_model.kernel import kernel
from golden_model.transforms.flux_park import LAMBDA_M

OMEGA_0 = Format(0, -2, 18)
XI = Format(0, 2, 14)
Y = Format(1, -1, 25)
X = Format(1, -3, 36)
Y_W, X_W = Y.width, X.width
DROP_RHO = PU.frac_bits + RESISTANCE.frac_bits - FLUX_STATE.frac_bits
DROP_Y = FLUX.frac_bits + OMEGA_0.frac_bits - Y.frac_bits
DROP_X = Y.frac_bits + OMEGA_0.frac_bits - X.frac_bits
DROP_XI = Y.frac_bits + XI.frac_bits - 1 - FLUX_STATE.frac_bits
DROP_U = FLUX.frac_bits + SAMPLE_TIME.frac_bits - FLUX_STATE.frac_bits
X_TO_STATE = X.frac_bits - FLUX_STATE.frac_bits


class State(NamedTuple):
    lambda_alpha: int = 0  # FLUX_STATE: integrated to this sample, without its resistive drop
    lambda_beta: int = 0
    x_alpha: int = 0  # X: integral of eps, per sample
    x_beta: int = 0
    known: int = 0  # the voltage of the last period was known


@kernel
def axis(carried, x, i, lambda_c, u, trusted, rho, omega_0, xi, t_s):
    """One axis: (flux integrated to the next sample, x, 1 if anything was limited)."""
    drop = round_half_up(rho * i, DROP_RHO)
    push = round_half_up(u * t_s, DROP_U) - drop
    now = carried - drop
    lambda_now = saturate(now, FLUX_STATE_W)
    if not trusted:
        lambda_now, x = lambda_c << FLUX_TO_STATE, 0
    diff = lambda_c - round_sat(lambda_now, FLUX_TO_STATE, FLUX_W)
    eps = saturate(diff, FLUX_W) if trusted else 0
    y = round_half_up(eps * omega_0, DROP_Y)
    x_next, x_limited = multiply_add(y, omega_0, x, DROP_X, X_W)
    corrected = lambda_now + push + round_half_up(y * xi, DROP_XI)
    total = corrected + round_half_up(x_next, X_TO_STATE)
    limited = exceeds(total, FLUX_STATE_W)
    if trusted:
        limited = limited | exceeds(now, FLUX_STATE_W) | exceeds(diff, FLUX_W) | x_limited
    return saturate(total, FLUX_STATE_W), x_next, limited


@kernel
def step(state, inputs, regs):
    x, r = inputs, regs
    trusted, gains = state.known & x.run, (x.rho, r.omega_0, r.xi, r.t_s)
    lambda_alpha, x_alpha, limited_alpha = axis(
        state.lambda_alpha, state.x_alpha, x.i_alpha, x.lambda_c_alpha, x.u_applied_alpha, trusted, *gains
    )
    lambda_beta, x_beta, limited_beta = axis(
        state.lambda_beta, state.x_beta, x.i_beta, x.lambda_c_beta, x.u_applied_beta, trusted, *gains
    )
    lambda_m_alpha = round_sat(lambda_alpha, FLUX_TO_STATE, FLUX_W)
    lambda_m_beta = round_sat(lambda_beta, FLUX_TO_STATE, FLUX_W)
    state = State(lambda_alpha, lambda_beta, x_alpha, x_beta, x.voltage_known)
    return state, (lambda_m_alpha, lambda_m_beta, x.voltage_known, limited_alpha | limited_beta)


def reference(v, state):
    out = {}
    for n, of in enumerate(("alpha", "beta")):
        carried, x = state[n] * FLUX_STATE.lsb, state[2 + n] * X.lsb
        drop = v["rho"] * v[f"i_{of}"]
        now = FLUX_STATE.limit(carried - drop)
        eps = FLUX.limit(v[f"lambda_c_{of}"] - now)
        y = v["omega_0"] * eps
        base = now + 2 * v["xi"] * y + X.limit(x + v["omega_0"] * y)
        if not (state.known and v["run"]):
            base = v[f"lambda_c_{of}"]
        out[f"lambda_m_{of}"] = FLUX.limit(base + v["t_s"] * v[f"u_applied_{of}"] - drop)
    return out


def bound(v, _state):
    """Each rounding is half an LSB of its format, weighted by the gains that follow."""
    inner = FLUX_STATE.lsb / 2
    y = v["omega_0"] * (inner + FLUX.lsb) + Y.lsb / 2  # rounding of the flux, and one LSB at the end of its range
    total = 4 * inner + 2 * v["xi"] * y + v["omega_0"] * y + X.lsb / 2 + inner
    return dict.fromkeys(("lambda_m_alpha", "lambda_m_beta"), total + FLUX.lsb)


def stimuli(rng, _config):
    """Random flux and voltage, gains at both ends of their ranges, into the limits and back; gates off."""
    nominal = {"rho": 40000, "omega_0": 4118, "xi": 11585, "t_s": 32925, "run": 1, "voltage_known": 1}
    rows = []
    for change in (
        {},
        {"omega_0": OMEGA_0.hi, "xi": 32768},
        {"omega_0": 256, "xi": 4096},
        {"t_s": SAMPLE_TIME.hi},
    ):
        for _ in range(25):
            signals = {k: int(rng.integers(-(1 << 22), 1 << 22)) for k in ("lambda_c_alpha", "u_applied_alpha")}
            signals |= {"lambda_c_beta": int(rng.integers(-9, 9)), "u_applied_beta": int(rng.integers(-9, 9))}
            rows.append({**nominal, **change, **signals, "i_alpha": int(rng.integers(-9999, 9999)), "i_beta": 0})
    for end in (FLUX.hi, FLUX.lo):
        pushed = {f"{k}_{of}": end for k in ("lambda_c", "u_applied") for of in ("alpha", "beta")}
        rows += [{**nominal, **pushed, "omega_0": OMEGA_0.hi, "i_alpha": 0, "i_beta": 0} for _ in range(40)]
    rows += [{**rows[-1], "run": 0}, rows[-1], {**rows[-1], "voltage_known": 0}, rows[-1], rows[0]]
    for _ in range(12):  # both axes between the limits, where every bit of the state counts
        gains = {"omega_0": int(rng.integers(256, OMEGA_0.hi)), "xi": int(rng.integers(4096, 32769))}
        for _ in range(24):
            size = 1 << int(rng.integers(8, 23))
            names = [f"{k}_{axis}" for k in ("lambda_c", "u_applied") for axis in ("alpha", "beta")]
            signals = {name: int(rng.integers(-size, size)) for name in names}
            signals |= {f"i_{axis}": int(rng.integers(-99999, 99999)) for axis in ("alpha", "beta")}
            rows.append({**nominal, **gains, **signals})
    return rows


INPUTS = (
    Port("i_alpha", PU, doc="current, alpha"),
    Port("i_beta", PU, doc="current, beta"),
    Port("lambda_c_alpha", FLUX, doc="flux linkage of the current model, alpha"),
    Port("lambda_c_beta", FLUX, doc="flux linkage of the current model, beta"),
    Port("u_applied_alpha", FLUX, doc="voltage of the coming period, alpha"),
    Port("u_applied_beta", FLUX, doc="voltage of the coming period, beta"),
    Port("voltage_known", BIT, doc="0: gates off or bus reading lost"),
    Port("run", BIT, doc="1: the gates are switching"),
    RHO,
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("omega_0", OMEGA_0, lo=1 << 8, doc="crossover of the two models, times the sample time"),
    Port("xi", XI, lo=1 << 12, hi=1 << 15, doc="damping of the merge"),
    T_S,
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="flux_merge",
    folder="estimators",
    paper="001, eq. (7); 'Merge of voltage and current models' of Fig. 8",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        *LAMBDA_M,
        Port("merge_known", BIT, doc="1: the merged flux is valid at the next sample"),
        Port("merge_limited", BIT, doc="the merge reached its range"),
    ),
    state=State(),
    latency=30,
    interval=30,
    constants={
        "Y_W": Y_W,
        "X_W": X_W,
        "DROP_RHO": DROP_RHO,
        "DROP_Y": DROP_Y,
        "DROP_X": DROP_X,
        "DROP_XI": DROP_XI,
        "DROP_U": DROP_U,
        "X_TO_STATE": X_TO_STATE,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
