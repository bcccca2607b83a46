# SPDX-License-Identifier: BSD-3-Clause
"""Adaline of the magnet flux, paper 000 eq. (13), extended to any i_d and salient motors.

    e      = u_q - v_leg*d_q - r*i_q - omega*(l_d*i_d + psi_m)          eq. (7b); l_d*i_d is zero in eq. (11)
    psi_m += eta_psi*omega*e                                            eta_psi = 2*eta

u_q is the commanded voltage including the dead-time compensation; v_leg*d_q is the voltage loss of the legs.
omega is the chord speed, as in the decoupling.
Held, and reported by ``psi_held``, if the speed is so low that errors of the voltage dominate the EMF, or while the
voltage is at its limit, a converter at its end, the bus reading lost or the gates off.

Formats: v_leg*d_q and r*i_q to FLUX, l_d*i_d to FLUX, saturated; their product with omega to FLUX; e FLUX, saturated;
omega*e FLUX; psi_m S(1,34), so that an eta of 1e-4 per unit still moves it by an LSB of omega*e; out PU.  All half up.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add, multiply_subtract
from golden_model.control.current_pi import SAT
from golden_model.control.dead_time_compensation import D_Q
from golden_model.estimators.flux_models import L_D
from golden_model.estimators.v_dead_adaline import V_LEG_PORT
from golden_model.estimators.winding_resistance import R
from golden_model.fixed import Format, round_half_up, round_sat, saturate
from golden_model.formats import (
    BIT,
    FLUX,
    FLUX_W,
    INDUCTANCE,
    PU,
    PU_TO_FLUX,
    PU_W,
    RESISTANCE,
    V_LEG,
)
from golden_model.kernel import kernel

ETA_PSI = Format(0, -2, 19)
PSI_STATE = Format(1, 1, 34)
PSI_STATE_W = PSI_STATE.width
DROP_V = PU.frac_bits + V_LEG.frac_bits - FLUX.frac_bits
DROP_R = PU.frac_bits + RESISTANCE.frac_bits - FLUX.frac_bits
DROP_L = PU.frac_bits + INDUCTANCE.frac_bits - FLUX.frac_bits
DROP_OMEGA = PU.frac_bits
DROP_ETA = FLUX.frac_bits + ETA_PSI.frac_bits - PSI_STATE.frac_bits
TO_FLUX = PSI_STATE.frac_bits - FLUX.frac_bits
TO_PU = PSI_STATE.frac_bits - PU.frac_bits


class State(NamedTuple):
    psi_m: int = 0  # PSI_STATE


@kernel
def step(state, inputs, regs):
    x, r = inputs, regs
    own = round_sat(r.l_d * x.i_d, DROP_L, FLUX_W)
    flux = saturate(own + round_sat(state.psi_m, TO_FLUX, FLUX_W), FLUX_W)
    after_v = (x.u_q << PU_TO_FLUX) - round_half_up(x.v_leg * x.d_q, DROP_V)
    rest = after_v - round_half_up(x.r * x.i_q, DROP_R)
    e, _ = multiply_subtract(flux, x.omega_chord, rest, DROP_OMEGA, FLUX_W)
    pull = round_sat(e * x.omega_chord, DROP_OMEGA, FLUX_W)
    held = 1
    if x.run and x.voltage_known and x.sat_d == 0 and x.sat_q == 0 and x.current_at_rail == 0:
        held = 1 if abs(x.omega_chord) < r.omega_psi_min else 0
    psi = state.psi_m
    if not held:
        psi, _ = multiply_add(pull, r.eta_psi, psi, DROP_ETA, PSI_STATE_W)
    return State(psi), (round_sat(psi, TO_PU, PU_W), held)


def reference(v, state):
    psi = state.psi_m * PSI_STATE.lsb
    bad = v["sat_d"] or v["sat_q"] or v["current_at_rail"] or not (v["run"] and v["voltage_known"])
    if not bad and abs(v["omega_chord"]) >= v["omega_psi_min"]:
        flux = FLUX.limit(FLUX.limit(v["l_d"] * v["i_d"]) + psi)
        lost = v["v_leg"] * v["d_q"] + v["r"] * v["i_q"]
        e = FLUX.limit(v["u_q"] - lost - v["omega_chord"] * flux)
        psi = PSI_STATE.limit(psi + v["eta_psi"] * FLUX.limit(v["omega_chord"] * e))
    return {"psi_m": PU.limit(psi)}


def bound(v, _state):
    e = 1.5 * FLUX.lsb + 2 * (FLUX.lsb + FLUX.lsb) + FLUX.lsb
    return {"psi_m": v["eta_psi"] * (2 * e + 2 * FLUX.lsb) + PSI_STATE.lsb + PU.lsb}


def stimuli(rng, _config):
    """Constant speed until the estimate settles, both directions; the lowest speed; each cause of a hold; the ends."""
    calm = {
        "sat_d": 0,
        "sat_q": 0,
        "current_at_rail": 0,
        "voltage_known": 1,
        "run": 1,
        "l_d": 529109,
        "r": 641729,
    }
    rows = []
    for omega in (49152, -49152, 131071, -131072):
        for _ in range(20):
            u_q = omega * 27000 // 65536 + int(rng.integers(-50, 50))
            rows.append({**calm, "omega_chord": omega, "u_q": max(min(u_q, PU.hi), PU.lo), "i_d": -3000, "i_q": 9000})
    rows = [{**row, "v_leg": 5000, "d_q": 80000, "eta_psi": 40000, "omega_psi_min": 3000} for row in rows]
    for change in ({"sat_d": 1}, {"sat_q": -1}, {"current_at_rail": 1}, {"voltage_known": 0}, {"run": 0}):
        rows.append({**rows[0], **change})
    for omega in (2999, 3000, 3001, -2999, -3000, -3001):
        rows.append({**rows[0], "omega_chord": omega})
    for u_q in (PU.hi, PU.lo):
        rows += [{**rows[0], "u_q": u_q, "eta_psi": ETA_PSI.hi, "omega_chord": PU.hi} for _ in range(25)]
        for i_d in (0, 3000, -3000):  # to the end of psi_m, and back
            end = {**rows[0], "eta_psi": ETA_PSI.hi, "omega_chord": 32768, "i_d": i_d}
            rows += [{**end, "u_q": u_q}] * 25 + [{**end, "u_q": 0}]
    for end in (1, -1):  # at either end of psi_m, or of the flux, a small error shows every bit of the flux
        push = {**rows[0], "v_leg": 0, "r": 0, "i_d": 0, "eta_psi": ETA_PSI.hi, "omega_chord": 45000}
        push |= {"u_q": PU.hi if end > 0 else PU.lo}
        rows += [push] * 20
        for k in range(60):
            omega, off = int(rng.integers(20000, 65000)), int(rng.integers(400))
            small = {"omega_chord": omega, "u_q": end * (2 * omega - off), "i_d": 3000 * end * (k % 2)}
            rows += [{**push, **small}] + [push] * 3
    for k in range(12):  # between the limits, where every bit of the state counts
        settings = {"eta_psi": int(rng.integers(ETA_PSI.hi)), "omega_psi_min": int(rng.integers(1 << (k + 4)))}
        settings |= {"l_d": int(rng.integers(1 << 20)), "r": int(rng.integers(1 << 20))}
        for _ in range(24):
            omega, load = int(rng.integers(-131072, 131072)), int(rng.integers(1, 20000))
            signals = {"omega_chord": omega, "v_leg": int(rng.integers(9000)), "d_q": int(rng.integers(-80000, 80000))}
            signals |= {"i_d": int(rng.integers(-load, load)), "i_q": int(rng.integers(-load, load))}
            u_q = omega * 24000 // 65536 + int(rng.integers(-load, load))
            rows.append({**rows[0], **settings, **signals, "u_q": min(max(u_q, PU.lo), PU.hi)})
    return rows


def patient_stimuli(rng, _config):
    """A single small error at either end of psi_m or of the flux, then a slow walk on which less than an LSB shows."""
    rows = []
    row = {"sat_d": 0, "sat_q": 0, "current_at_rail": 0, "voltage_known": 1, "run": 1, "l_d": 529109, "r": 0}
    row |= {"v_leg": 0, "d_q": 0, "i_q": 0, "eta_psi": ETA_PSI.hi, "omega_psi_min": 3000}
    for k in range(24):
        end = 1 if k % 2 else -1
        push = row | {"omega_chord": 45000, "u_q": PU.hi if end > 0 else PU.lo, "i_d": 0}
        omega, off = int(rng.integers(30000, 65000)), int(rng.integers(400))
        small = {"omega_chord": omega, "u_q": end * (2 * omega - off), "i_d": end * (k // 2 % 2) * 3000}
        rows += [push] * 20 + [row | small]
        for _ in range(150):
            rows.append(row | {"omega_chord": 6000, "u_q": end * 9000 + int(rng.integers(-2000, 2000)), "i_d": 0})
    return rows


INPUTS = (
    Port("u_q", PU, doc="voltage, q axis"),
    D_Q,
    V_LEG_PORT,
    Port("i_d", PU, doc="current, d axis"),
    Port("i_q", PU, doc="current, q axis"),
    R,
    Port("omega_chord", PU, doc="electrical speed along the chord of a sample"),
    Port("sat_d", SAT, lo=-1, hi=1, doc="active limit, d axis: 1 upper, -1 lower, 0 none"),
    Port("sat_q", SAT, lo=-1, hi=1, doc="active limit, q axis: 1 upper, -1 lower, 0 none"),
    Port("current_at_rail", Format(0, 3, 0), doc="bit x: ADC code of phase x at either end"),
    Port("voltage_known", BIT, doc="0: gates off or bus reading lost"),
    Port("run", BIT, doc="1: the gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    L_D,
    Port("eta_psi", ETA_PSI, doc="step of the psi_m Adaline, 2*eta per unit"),
    Port("omega_psi_min", Format(0, 1, 16), doc="psi_m is held below this speed"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="psi_adaline",
    folder="estimators",
    paper="000, eq. (13), with the reluctance term of eq. (7b)",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("psi_m", PU, doc="flux linkage of the magnets"),
        Port("psi_held", BIT, doc="1: psi_m is held"),
    ),
    state=State(),
    latency=16,
    interval=16,
    constants={
        "PSI_STATE_W": PSI_STATE_W,
        "DROP_V": DROP_V,
        "DROP_R": DROP_R,
        "DROP_L": DROP_L,
        "DROP_OMEGA": DROP_OMEGA,
        "DROP_ETA": DROP_ETA,
        "TO_FLUX": TO_FLUX,
        "TO_PU": TO_PU,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
