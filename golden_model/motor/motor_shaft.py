# SPDX-License-Identifier: BSD-3-Clause
"""Torque, speed and angle of the shaft: J d omega/dt = T - load - B*omega - coulomb*sign(omega), d theta/dt = omega.

    torque = turn_d*i_q - turn_q*i_d;  net = torque + cogging - load - viscous*omega
    omega += k_j*(net -+ coulomb);  theta += omega;  theta_e = pole_pairs*theta

At standstill Coulomb friction holds the shaft while it exceeds ``net``, and it never turns the shaft back: a speed that
changes its sign is zero for a step.  ``hold`` = 1: the speed is ``omega_set``, as on a dynamometer.  ``start``: angle
and speed begin at zero.
Formats: torques S(1,23), the base is that of flux times current; k_j U(-31,56), viscous U(12,5), both for a step.
Speed S(-13,56) in turns a step, angle U(0,56) in turns, exact; outputs cut (floor).  Products half up, sums saturate.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.common.sum_of_products import difference_of_products
from golden_model.fixed import Format, round_half_up, saturate, wrap
from golden_model.formats import BIT, FLUX, FLUX_W, MOTOR_ANGLE, MOTOR_SPEED, MOTOR_WAVE, PU
from golden_model.kernel import kernel

OMEGA = Format(1, -13, 56)
THETA = Format(0, 0, 56)
INERTIA = Format(0, -31, 56)
VISCOUS = Format(0, 12, 5)
COULOMB = Format(0, 0, 23)
POLE_PAIRS = Format(0, 5, 0)
SET = Format(1, -13, 30)
OMEGA_W, THETA_W, ANGLE_W = OMEGA.width, THETA.width, MOTOR_ANGLE.width
DROP_TORQUE = PU.frac_bits
DROP_VISCOUS = MOTOR_SPEED.frac_bits + VISCOUS.frac_bits - FLUX.frac_bits
DROP_J = FLUX.frac_bits + INERTIA.frac_bits - OMEGA.frac_bits
DROP_OMEGA = OMEGA.frac_bits - MOTOR_SPEED.frac_bits
DROP_THETA = THETA_W - ANGLE_W
SET_SHIFT = OMEGA.frac_bits - SET.frac_bits
WAVE_SHIFT = FLUX.frac_bits - MOTOR_WAVE.frac_bits
LOW_BITS = 8  # of k_j, for the second multiplier
VISCOUS_W = 27


class State(NamedTuple):
    omega: int = 0
    theta: int = 0


@kernel
def moving(net, omega, coulomb):
    """The torque that moves the shaft: what Coulomb friction leaves of ``net``."""
    if omega > 0 or (omega == 0 and net > coulomb):
        return saturate(net - coulomb, FLUX_W)
    if omega < 0 or net < -coulomb:
        return saturate(net + coulomb, FLUX_W)
    return 0


@kernel
def step(state, inputs, regs):
    x, r = inputs, regs
    torque = difference_of_products(x.turn_q, x.i_d, x.turn_d, x.i_q, DROP_TORQUE, FLUX_W)
    drag, _ = multiply_add(state.omega >> DROP_OMEGA, r.viscous, 0, DROP_VISCOUS, VISCOUS_W)
    net = saturate(torque + (x.cogging << WAVE_SHIFT) - x.load - drag, FLUX_W)
    omega = state.omega + round_half_up(moving(net, state.omega, r.coulomb) * r.k_j, DROP_J)
    if r.coulomb > 0 and ((state.omega > 0 and omega < 0) or (state.omega < 0 and omega > 0)):
        omega = 0
    omega = saturate(omega, OMEGA_W)
    if r.hold:
        omega = r.omega_set << SET_SHIFT
    theta = wrap(state.theta + omega, THETA_W)
    if x.start:
        omega, theta = 0, 0
    theta_m = theta >> DROP_THETA
    theta_e = wrap(theta_m * r.pole_pairs, ANGLE_W)
    return State(omega, theta), (torque, omega >> DROP_OMEGA, theta_m, theta_e)


def reference(v, state):
    """Exact but for the cuts; a torque within its rounding of the friction's limit may move the shaft or not."""
    torque = FLUX.limit(v["turn_d"] * v["i_q"] - v["turn_q"] * v["i_d"])
    before = state.omega * OMEGA.lsb
    net = FLUX.limit(torque + v["cogging"] - v["load"] - v["viscous"] * before)
    left = 0.0
    if before > 0 or (before == 0 and net > v["coulomb"]):
        left = FLUX.limit(net - v["coulomb"])
    elif before < 0 or net < -v["coulomb"]:
        left = FLUX.limit(net + v["coulomb"])
    omega = before + left * v["k_j"]
    if v["coulomb"] > 0 and before * omega < 0:
        omega = 0.0
    omega = v["omega_set"] if v["hold"] else OMEGA.limit(omega)
    theta = (state.theta * THETA.lsb + omega) % 1
    if v["start"]:
        omega = theta = 0.0
    return {"torque": torque, "omega_m": omega, "theta_m": theta, "theta_e": theta * v["pole_pairs"] % 1}


def bound(v, _state):
    """Torque and drag half up, the cut speed in the drag, k_j's product; the cuts of the outputs."""
    net = FLUX.lsb + (MOTOR_SPEED.lsb * v["viscous"])
    omega = 2 * net * v["k_j"] + OMEGA.lsb
    theta = omega + MOTOR_ANGLE.lsb
    return {
        "torque": FLUX.lsb / 2,
        "omega_m": omega + MOTOR_SPEED.lsb,
        "theta_m": theta,
        "theta_e": theta * max(v["pole_pairs"], 1),
    }


def stimuli(_rng, _config):
    """Friction just met and just missed at standstill, stops from both directions, every limit, the held speed."""
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"pole_pairs": 4}
    rows = []
    for sign in (1, -1):
        for off in (-1, 0, 1):
            rows.append(still | {"start": 1})
            rows += [still | {"coulomb": 5000, "load": -sign * (5000 + off), "k_j": INERTIA.hi}] * 3
        rows += [still | {"load": -sign * (1 << 22), "k_j": INERTIA.hi}] * 3
        rows += [still | {"load": sign * (1 << 20), "k_j": INERTIA.hi, "coulomb": 1 << 18}] * 16
        rows += [still | {"viscous": VISCOUS.hi, "k_j": INERTIA.hi, "load": -sign * FLUX.hi}] * 4
        for trial in (SET.hi, SET.lo, 1, -1):
            rows += [still | {"hold": 1, "omega_set": trial}] * 3
            rows += [still | {"viscous": VISCOUS.hi, "k_j": INERTIA.hi, "load": -sign * FLUX.hi, "pole_pairs": 31}] * 3
            rows += [still | {"load": -sign * FLUX.hi, "k_j": INERTIA.hi, "coulomb": COULOMB.hi}] * 3
        # Into a limit of the speed, and back by all bits that the output does not show: each of them moves it
        rows.append(still | {"hold": 1, "omega_set": SET.hi if sign > 0 else SET.lo})
        rows += [still | {"k_j": INERTIA.hi, "load": -sign * FLUX.hi}] * 3
        rows += [still | {"k_j": 1 << DROP_J, "load": sign * ((1 << DROP_OMEGA) - 1)}, still]
        for lo in (FLUX.lo, FLUX.hi):
            row = {"turn_d": lo, "turn_q": -lo - 1, "i_d": PU.hi, "i_q": PU.lo, "cogging": sign * MOTOR_WAVE.hi}
            rows += [still | row | {"k_j": 12345678}, still | row | {"k_j": 255, "load": lo}]
    return rows


INPUTS = (
    Port("turn_d", FLUX, doc="flux that makes torque with i_q"),
    Port("turn_q", FLUX, doc="flux that makes torque with -i_d"),
    Port("i_d", PU, doc="current, d axis"),
    Port("i_q", PU, doc="current, q axis"),
    Port("cogging", MOTOR_WAVE, doc="cogging torque"),
    Port("load", FLUX, doc="load torque"),
    Port("start", BIT, doc="1: angle and speed are zero"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("k_j", INERTIA, doc="speed per torque and step: one over the inertia"),
    Port("viscous", VISCOUS, doc="torque per speed"),
    Port("coulomb", COULOMB, doc="Coulomb friction torque"),
    Port("pole_pairs", POLE_PAIRS, doc="pole pairs"),
    Port("hold", BIT, doc="1: the speed is omega_set"),
    Port("omega_set", SET, doc="held speed, turns a step"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="motor_shaft",
    folder="motor",
    paper="docs/hil.md: shaft",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("torque", FLUX, doc="torque of the air gap without cogging"),
        Port("omega_m", MOTOR_SPEED, doc="mechanical speed, turns a step"),
        Port("theta_m", MOTOR_ANGLE, doc="mechanical angle"),
        Port("theta_e", MOTOR_ANGLE, doc="electrical angle"),
    ),
    state=State(),
    latency=13,
    interval=13,
    constants={
        "DROP_TORQUE": DROP_TORQUE,
        "DROP_VISCOUS": DROP_VISCOUS,
        "DROP_J": DROP_J,
        "DROP_OMEGA": DROP_OMEGA,
        "SET_SHIFT": SET_SHIFT,
        "WAVE_SHIFT": WAVE_SHIFT,
        "LOW_BITS": LOW_BITS,
        "OMEGA_W": OMEGA_W,
        "THETA_W": THETA_W,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
