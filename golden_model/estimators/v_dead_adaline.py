# SPDX-License-Identifier: BSD-3-Clause
"""Adaline of V_dead, paper 000 eq. (10), and the minimisation of its Fig. 4(a).

    lp_u += k_lp*(u_pi_d - lp_u),  u_h = u_pi_d - lp_u             Fig. 3: harmonics in the regulator output
    lp_d += k_lp*(d_d - lp_d),     d_h = d_d - lp_d                the same filter on the regressor
    e     = u_h - v_dead*d_h
    v_dead += eta_v*d_h*e                                          eq. (10), eta_v = 2*9*eta
    v_sum  += zeta*v_dead                   while |v_dead| > v_thr
    v_comp  = limit(gamma*v_dead + v_sum, 0, v_comp_max)           gamma*V_dead of section V.B
    v_sum is v_start until the gates are on for the first time, and is kept when they are off again
    v_leg   = v_comp + v_dead                                      the whole estimated loss of a leg

Sign and scale: v_dead is the voltage loss of a leg in the direction of its current, positive; the paper's V_dead is
minus a third of it, and its D is three times d.  u_pi_d excludes the decoupling, and with it L_q*omega*i_q of (8d).
The paper filters u_d* only: with i_d = 0 the mean of D_d is zero.  With i_d /= 0 it is not, and a regressor with a
mean would bias the estimate to var(D_d)/mean(D_d**2) of the true value; the same filter on both signals removes the
mean and delays both equally (docs/vsi_estimators.md).
Fig. 4(a) adds zeta to gamma in every step until |V_dead| < V_thr.  While V_dead -> 0 the product gamma*V_dead must
stay, so gamma -> infinity.  Instead, v_sum accumulates the increments of the product, zeta*v_dead.
The Adaline is held while the gates are off, the voltage or a converter is at its end, or |i_d| + |i_q| < i_learn: close
to zero current the directions are uncertain, and an oscillation there would give a negative loss.

Formats: lp S(1,28); u_h, d_h PU; e FLUX; d_h*e S(-4,21), saturated: a smaller step with the same sign; v_dead and
v_sum S(-1,38), where an eta of 1e-6 and an error of 2**-22 still change them (docs, word lengths); v_comp, v_leg V_LEG.
All rounded half up.  Limits: v_dead within +-v_comp_max, v_sum and v_comp from zero to v_comp_max, v_leg saturated.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add, multiply_subtract
from golden_model.control.current_pi import SAT
from golden_model.control.dead_time_compensation import D_D
from golden_model.fixed import Format, clamp, round_half_up, round_sat, saturate
from golden_model.formats import (
    BIT,
    FLUX,
    FLUX_W,
    INTEGRAL,
    INTEGRAL_W,
    PU,
    PU_TO_FLUX,
    PU_TO_INTEGRAL,
    PU_W,
    V_LEG,
    V_LEG_W,
)
from golden_model.kernel import kernel

K_LP = Format(0, 0, 20)
V_STATE = Format(1, -1, 38)
V_FINE = Format(1, -1, 25)
ETA_V = Format(0, 2, 19)
ETA_V_MAX = (1 << ETA_V.frac_bits) * 9 // 4 - 1  # eq. (B.3): eta < 0.125, |D_d| = 2 at i_d = 0
STEP = Format(1, -4, 21)
GAMMA = Format(0, 2, 15)
ZETA = Format(0, -5, 22)
V_LEVEL = Format(0, -1, 18)
V_STATE_W, STEP_W = V_STATE.width, STEP.width
DROP_LP = PU.frac_bits + K_LP.frac_bits - INTEGRAL.frac_bits
DROP_FINE = V_STATE.frac_bits - V_FINE.frac_bits
DROP_MODEL = V_FINE.frac_bits + PU.frac_bits - FLUX.frac_bits
DROP_STEP = FLUX.frac_bits + PU.frac_bits - STEP.frac_bits
DROP_ETA = STEP.frac_bits + ETA_V.frac_bits - V_STATE.frac_bits
DROP_ZETA = V_FINE.frac_bits + ZETA.frac_bits - V_STATE.frac_bits
DROP_GAMMA = V_FINE.frac_bits + GAMMA.frac_bits - V_STATE.frac_bits
TO_LEG = V_STATE.frac_bits - V_LEG.frac_bits
FINE_TO_LEG = V_FINE.frac_bits - V_LEG.frac_bits


class State(NamedTuple):
    lp_u: int = 0  # INTEGRAL
    lp_d: int = 0
    v_dead: int = 0  # V_STATE
    v_sum: int = 0
    begun: int = 0  # 1: the gates have been on; v_sum is learnt from v_start on


@kernel
def low_pass(lp, x, k_lp):
    """(next state, x minus the low-pass output), both from the state before.

    lp moves by no more than the distance of two PU numbers, so it rounds to one: half an LSB beyond is the most.
    """
    err = saturate(x - round_half_up(lp, PU_TO_INTEGRAL), PU_W)
    moved, _ = multiply_add(err, k_lp, lp, DROP_LP, INTEGRAL_W)
    return moved, err


@kernel
def step(state, inputs, regs):
    x, r = inputs, regs
    calm = x.run and x.sat_d == 0 and x.sat_q == 0 and x.current_at_rail == 0 and x.voltage_known
    learning = 1 if calm and abs(x.i_d) + abs(x.i_q) >= r.i_learn else 0
    limit = r.v_comp_max << TO_LEG
    lp_d, d_h = low_pass(state.lp_d, x.d_d, r.k_lp)
    lp_u, u_h = low_pass(state.lp_u, x.u_pi_d, r.k_lp)
    if not x.run:
        lp_u, lp_d = 0, 0
    fine = round_half_up(state.v_dead, DROP_FINE)
    e, _ = multiply_subtract(fine, d_h, u_h << PU_TO_FLUX, DROP_MODEL, FLUX_W)
    pull = round_sat(d_h * e, DROP_STEP, STEP_W)
    v_dead = state.v_dead
    if learning:
        v_dead = clamp(v_dead + round_half_up(pull * r.eta_v, DROP_ETA), -limit, limit)
    fine = round_half_up(v_dead, DROP_FINE)
    v_sum = state.v_sum if state.begun else r.v_start << TO_LEG
    if not r.compensate:
        v_sum = 0
    elif learning and abs(fine) > (r.v_thr << FINE_TO_LEG):
        v_sum += round_half_up(fine * r.zeta, DROP_ZETA)
    v_sum = clamp(v_sum, 0, limit)
    asked = v_sum + round_half_up(fine * r.gamma, DROP_GAMMA)
    v_comp = round_half_up(clamp(asked, 0, limit), TO_LEG) if r.compensate else 0
    v_leg = saturate(v_comp + round_half_up(fine, FINE_TO_LEG), V_LEG_W)
    limited = 1 if r.compensate and asked > limit else 0
    return State(lp_u, lp_d, v_dead, v_sum, 1 if x.run else state.begun), (
        round_half_up(fine, FINE_TO_LEG),
        v_comp,
        v_leg,
        limited,
    )


def filtered(lp, x, k_lp):
    """The low-pass in real numbers: (next state, x minus the low-pass output)."""
    old = lp * INTEGRAL.lsb
    err = PU.limit(x - old)
    return INTEGRAL.limit(old + k_lp * err), err


def reference(v, state):
    learning = v["run"] and not (v["sat_d"] or v["sat_q"] or v["current_at_rail"]) and v["voltage_known"]
    learning = learning and abs(v["i_d"]) + abs(v["i_q"]) >= v["i_learn"]
    limit = v["v_comp_max"]
    _, u_h = filtered(state.lp_u, v["u_pi_d"], v["k_lp"])
    _, d_h = filtered(state.lp_d, v["d_d"], v["k_lp"])
    v_dead = state.v_dead * V_STATE.lsb
    v_sum = state.v_sum * V_STATE.lsb if state.begun else v["v_start"]
    e = FLUX.limit(u_h - v_dead * d_h)
    if learning:
        v_dead = min(max(v_dead + v["eta_v"] * STEP.limit(d_h * e), -limit), limit)
    if learning and abs(v_dead) > v["v_thr"]:
        v_sum += v["zeta"] * v_dead
    v_sum = min(max(v_sum, 0.0), limit)
    v_comp = min(max(v_sum + v["gamma"] * v_dead, 0.0), limit) if v["compensate"] else 0.0
    return {"v_dead": V_LEG.limit(v_dead), "v_comp": v_comp, "v_leg": V_LEG.limit(v_comp + v_dead)}


def bound(v, _state):
    """Errors of u_h and d_h (half an LSB of PU) and of v_dead (half an LSB of V_FINE), then the roundings of the step.

    Close to v_thr model and reference may disagree on the increment of v_sum, zeta*v_thr at most.
    """
    h = PU.lsb / 2 + PU.lsb  # the low-pass output rounded, and the ends of PU
    e = h + 0.5 * h + 2 * V_FINE.lsb + FLUX.lsb
    pull = 2 * e + 2.1 * h + STEP.lsb
    v_dead = v["eta_v"] * pull + V_STATE.lsb + V_LEG.lsb
    v_comp = (v["gamma"] + v["zeta"]) * (v_dead + V_FINE.lsb) + v["zeta"] * v["v_thr"] + 4 * V_STATE.lsb + V_LEG.lsb
    return {"v_dead": v_dead, "v_comp": v_comp, "v_leg": v_dead + v_comp}


def stimuli(rng, _config):
    """A sawtooth of D with a regulator's response; each cause of a hold; limits; thresholds; stop."""
    calm = {"sat_d": 0, "sat_q": 0, "current_at_rail": 0, "voltage_known": 1, "run": 1, "compensate": 1}
    calm |= {"i_d": -3000, "i_q": 9000, "i_learn": 12000}
    gains = {"k_lp": 6600, "eta_v": 20000, "gamma": 3277, "zeta": 40000, "v_thr": 3, "v_comp_max": 6000}
    rows = []
    for k in range(120):
        saw = int(43690 * ((k % 17) / 8.0 - 1.0))
        rows.append({**calm, **gains, "d_d": saw, "u_pi_d": saw // 20 + int(rng.integers(-20, 20))})
    for change in (
        {"sat_d": 1}, {"sat_q": -1}, {"current_at_rail": 2}, {"voltage_known": 0}, {"run": 0}, {"compensate": 0}, {},
        {"i_q": 8999}, {"i_d": 0, "i_q": -12000}, {"i_d": -11999, "i_q": 0},
        {"v_thr": V_LEVEL.hi}, {"v_comp_max": 0}, {"v_comp_max": V_LEVEL.hi, "eta_v": ETA_V_MAX},
    ):  # fmt: skip
        rows += [{**rows[n], **change} for n in (3, 11, 60)]
    for sign in (1, -1):  # into both ends
        end = {**calm, **gains, "eta_v": ETA_V_MAX, "v_comp_max": V_LEVEL.hi, "k_lp": 1, "zeta": ZETA.hi}
        rows += [{**end, "d_d": 80000, "u_pi_d": sign * 131071} for _ in range(90)]
        still = {**rows[-1], "v_thr": V_LEVEL.hi}  # v_dead is at the threshold, not above
        rows += [{**still, "compensate": 0}, still, still]
    for k_lp, u_pi_d, d_d, run in ((0, 0, 0, 0), (524032, -1, 0, 1), (K_LP.hi, PU.lo, 0, 1), (0, 0, 40000, 1)):
        rows.append({**calm, **gains, "k_lp": k_lp, "u_pi_d": u_pi_d, "d_d": d_d, "run": run})  # lp_u beyond its range
    past_its_end = (
        (0, 0, 0, 0), (524032, -1, 0, 1), (K_LP.hi, PU.lo, 0, 1), (652288, PU.lo + 1, 0, 1), (0, PU.lo, 40000, 1),
    )  # fmt: skip
    for k_lp, u_pi_d, d_d, run in 3 * past_its_end:  # three times: a reset may occur between
        end = {**calm, **gains, "eta_v": ETA_V_MAX, "run": run}
        rows.append({**end, "k_lp": k_lp, "u_pi_d": u_pi_d, "d_d": d_d})  # shows one sample later
    free = {**calm, **gains, "eta_v": ETA_V_MAX, "gamma": GAMMA.hi, "v_comp_max": V_LEVEL.hi}
    for end, other in ((PU.lo, PU.hi), (PU.hi, PU.lo)):  # u_h or d_h at its own end, the rest small
        for k in range(14):
            for name, high in (("u_pi_d", PU.hi), ("d_d", D_D.high)):
                far = {"u_pi_d": 0, "d_d": 0, name: min(max(end, -high), high)}
                back = {"u_pi_d": 500, "d_d": 500, name: min(max(other, -high), high)}
                rows += [{**free, **far, "k_lp": K_LP.hi, "v_comp_max": 0}] * 3
                rows += [{**free, **back, "k_lp": 1 << k}] + [{**free, "k_lp": 1 << k, "d_d": 90 * k, "u_pi_d": 9}] * 2
    for k in range(40):  # v_start: before the first run, at it, after it, beyond the limit
        most = (V_LEVEL.hi, 900, 0, 40)[k % 4]
        begin = {"v_start": int(rng.integers(1, 1000)), "v_comp_max": most, "run": int(k % 5 > 1)}
        rows.append({**calm, **gains, **begin, "compensate": int(k % 7 > 0), "d_d": 20000, "u_pi_d": 700})
    for _ in range(80):  # at i_learn and beside it
        i_d, i_q = (int(rng.integers(-size, size)) for size in (1 << rng.integers(1, 18, 2)))
        off = int(rng.choice((0, 0, 1, -1, 1 << rng.integers(14))))
        learn = min(max(abs(i_d) + abs(i_q) + off, 0), 131071)
        rows.append({**free, "d_d": 30000 * (-1) ** len(rows), "u_pi_d": 900, "i_d": i_d, "i_q": i_q, "i_learn": learn})
    for k in range(12):  # between the limits, where every bit of the state counts
        free = {"k_lp": int(rng.integers(1 << (k + 9))), "eta_v": int(rng.integers(ETA_V_MAX)), "gamma": GAMMA.hi}
        free |= {"zeta": int(rng.integers(ZETA.hi)), "v_thr": int(rng.integers(1 << k)), "v_comp_max": V_LEVEL.hi}
        for _ in range(24):
            saw, size = int(rng.integers(-80000, 80000)), int(rng.integers(1, 1 << 15))
            currents = {"i_d": int(rng.integers(-9000, 0)), "i_q": int(rng.integers(-9000, 20000))}
            rows.append({**calm, **free, **currents, "d_d": saw, "u_pi_d": saw // 8 + int(rng.integers(-size, size))})
    return rows


V_DEAD = Port("v_dead", V_LEG, doc="leg voltage loss that is not compensated")
V_COMP = Port("v_comp", V_LEG, doc="leg voltage that is compensated")
V_LEG_PORT = Port("v_leg", V_LEG, doc="leg voltage loss by dead time and device drops")

INPUTS = (
    Port("u_pi_d", PU, doc="output of the current regulator, d axis"),
    D_D,
    Port("i_d", PU, doc="current, d axis"),
    Port("i_q", PU, doc="current, q axis"),
    Port("sat_d", SAT, lo=-1, hi=1, doc="active limit, d axis: 1 upper, -1 lower, 0 none"),
    Port("sat_q", SAT, lo=-1, hi=1, doc="active limit, q axis: 1 upper, -1 lower, 0 none"),
    Port("current_at_rail", Format(0, 3, 0), doc="bit x: ADC code of phase x at either end"),
    Port("voltage_known", BIT, doc="0: gates off or bus reading lost"),
    Port("run", BIT, doc="1: the gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("k_lp", K_LP, doc="weight of a new sample in the low-pass of Fig. 3"),
    Port("eta_v", ETA_V, hi=ETA_V_MAX, doc="step of the V_dead Adaline, 18*eta"),
    Port("gamma", GAMMA, doc="proportional part of the compensation"),
    Port("zeta", ZETA, doc="gain of the minimisation per sample"),
    Port("v_thr", V_LEVEL, doc="no minimisation below this |v_dead|"),
    Port("v_comp_max", V_LEVEL, doc="largest leg voltage that is compensated"),
    Port("i_learn", Format(0, 1, 16), doc="the V_dead Adaline is held below this |i_d| + |i_q|"),
    Port("compensate", BIT, doc="1: compensate dead time and drops"),
    Port("v_start", V_LEVEL, doc="leg voltage that is compensated until the Adaline has learnt it"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="v_dead_adaline",
    folder="estimators",
    paper="000, eq. (10) and Fig. 4(a)",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        V_DEAD,
        V_COMP,
        V_LEG_PORT,
        Port("v_comp_limited", BIT, doc="the compensation reached its limit"),
    ),
    state=State(),
    latency=22,
    interval=22,
    constants={
        "V_STATE_W": V_STATE_W,
        "V_FINE_W": V_FINE.width,
        "STEP_W": STEP_W,
        "DROP_LP": DROP_LP,
        "DROP_FINE": DROP_FINE,
        "DROP_MODEL": DROP_MODEL,
        "DROP_STEP": DROP_STEP,
        "DROP_ETA": DROP_ETA,
        "DROP_ZETA": DROP_ZETA,
        "DROP_GAMMA": DROP_GAMMA,
        "TO_LEG": TO_LEG,
        "FINE_TO_LEG": FINE_TO_LEG,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
