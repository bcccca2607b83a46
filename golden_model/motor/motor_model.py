# SPDX-License-Identifier: BSD-3-Clause
"""The motor as it is wired in rtl/motor/motor_model.vhd, a step of STEP clocks at a time.

A step n begins with its tick.  Each block starts when the one before it is done, so that a step's chain is longer than
a step; what a block reads is the newest that is there:

    flux(n)        voltages of the gates in step n - 1, currents of chain n - 3
    angle(n)       angle of chain n - 4
    currents(n)    fluxes and angle of n
    voltages in force in step n: of the currents of chain n - 3, with the bus voltage of step n - 1
    shaft(n)       currents and fluxes of n, cogging of n + 1, load of step n + 2

The first STARTING steps after a reset or after ``start`` hold the rotor at the angle zero with the flux psi_start.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from golden_model.kernel import kernel
from golden_model.motor import motor_angle, motor_current, motor_flux, motor_legs, motor_shaft, motor_unsaturated
from golden_model.motor.motor_angle import F_BITS, POINTS

STEP = 17  # clocks
STARTING = 12  # steps
REGISTERS = tuple(
    port for block in (motor_legs, motor_flux, motor_unsaturated, motor_shaft) for port in block.BLOCK.registers
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
flux_step, unsaturated_step, current_step = motor_flux.step, motor_unsaturated.step, motor_current.step
angle_step, legs_step, shaft_step = motor_angle.step, motor_legs.step, motor_shaft.step
AngleInputs, UnsaturatedInputs = motor_angle.Inputs, motor_unsaturated.Inputs
CurrentInputs, ShaftInputs = motor_current.Inputs, motor_shaft.Inputs
LAST_POINT = POINTS - 1


class Tables(NamedTuple):
    """Words of the block RAMs, int64: map of 64 x 64 points (d axis first), tables of POINTS words over a turn."""

    map_d: np.ndarray
    map_q: np.ndarray
    wave_d: np.ndarray
    wave_q: np.ndarray
    cogging: np.ndarray


class Inputs(NamedTuple):
    """What a step reads at its tick; for each leg the clocks of the step before with its upper or its lower gate on."""

    u_dc: int = 0
    load: int = 0
    start: int = 0
    high_a: int = 0
    low_a: int = 0
    high_b: int = 0
    low_b: int = 0
    high_c: int = 0
    low_c: int = 0


class Chain(NamedTuple):
    """What a step's chain has computed."""

    i_d: int = 0
    i_q: int = 0
    i_a: int = 0
    i_b: int = 0
    i_c: int = 0
    turn_d: int = 0
    turn_q: int = 0


class Shown(NamedTuple):
    """What stands at the outputs at a tick."""

    i_a: int = 0
    i_b: int = 0
    i_c: int = 0
    torque: int = 0
    omega_m: int = 0
    theta_m: int = 0
    theta_e: int = 0


class State(NamedTuple):
    of_flux: motor_flux.State = motor_flux.State()
    of_shaft: motor_shaft.State = motor_shaft.State()
    # Chains of the last four steps
    chain_1: Chain = Chain()
    chain_2: Chain = Chain()
    chain_3: Chain = Chain()
    chain_4: Chain = Chain()
    cogging_1: int = 0
    cogging_2: int = 0
    cogging_3: int = 0
    load_1: int = 0
    load_2: int = 0
    start_1: int = 1  # no step before the first one turns the shaft
    start_2: int = 1
    u_dc_1: int = 0
    starting: int = STARTING
    # Voltages in force in the step that ends: three of each leg
    voltages: tuple = (0,) * 9


@kernel
def angle(theta_e, theta_m, tables):
    """What follows from an angle, with the words of the tables on both sides of it."""
    at, after = theta_e >> F_BITS, ((theta_e >> F_BITS) + 1) & LAST_POINT
    at_m, after_m = theta_m >> F_BITS, ((theta_m >> F_BITS) + 1) & LAST_POINT
    return angle_step(
        AngleInputs(
            theta_e, theta_m, tables.wave_d[at], tables.wave_d[after], tables.wave_q[at], tables.wave_q[after],
            tables.cogging[at_m], tables.cogging[after_m],
        )
    )  # fmt: skip


@kernel
def currents(lambda_alpha, lambda_beta, at, regs, tables):
    """The chain of a step from its fluxes and what follows from its angle."""
    cos_theta, sin_theta, wave_d, wave_q, slope_d, slope_q, _ = at
    x_d, x_q, row, column, f_d, f_q, turn_d, turn_q, _, _ = unsaturated_step(
        UnsaturatedInputs(lambda_alpha, lambda_beta, cos_theta, sin_theta, wave_d, wave_q, slope_d, slope_q), regs
    )
    d, q, r, c = tables.map_d, tables.map_q, row, column
    i_d, i_q, i_a, i_b, i_c, turn_d, turn_q = current_step(
        CurrentInputs(
            x_d, x_q, f_d, f_q, cos_theta, sin_theta, turn_d, turn_q,
            d[r, c], d[r, c + 1], d[r + 1, c], d[r + 1, c + 1], q[r, c], q[r, c + 1], q[r + 1, c], q[r + 1, c + 1],
        )
    )  # fmt: skip
    return Chain(i_d, i_q, i_a, i_b, i_c, turn_d, turn_q)


@kernel
def summed(high, low, v_high, v_low, v_off, clocks):
    """A leg's voltage over the clocks of a step."""
    return high * v_high + low * v_low + (clocks - high - low) * v_off


@kernel
def step(state, inputs, regs, tables, clocks):
    """One step: (state, what stands at the outputs at its tick); ``clocks`` = STEP."""
    s, x, r, v = state, inputs, regs, state.voltages
    start = 1 if x.start or s.starting > 0 else 0
    before = s.chain_4
    shaft, (torque, omega_m, theta_m, theta_e) = shaft_step(
        s.of_shaft,
        ShaftInputs(before.turn_d, before.turn_q, before.i_d, before.i_q, s.cogging_3, s.load_2, s.start_2),
        r,
    )
    seen = s.chain_3
    leg_a = summed(x.high_a, x.low_a, v[0], v[1], v[2], clocks)
    leg_b = summed(x.high_b, x.low_b, v[3], v[4], v[5], clocks)
    leg_c = summed(x.high_c, x.low_c, v[6], v[7], v[8], clocks)
    flux, (lambda_alpha, lambda_beta) = flux_step(
        s.of_flux, leg_a, leg_b, leg_c, seen.i_a, seen.i_b, seen.i_c, start, r.r_a, r.r_b, r.r_c, r.psi_start
    )
    at = angle(theta_e, theta_m, tables)
    chain = currents(lambda_alpha, lambda_beta, at, r, tables)
    voltages = legs_step(seen.i_a, seen.i_b, seen.i_c, s.u_dc_1, r.stiffness, r.v_switch, r.v_diode)
    following = State(
        flux,
        shaft,
        chain,
        s.chain_1,
        s.chain_2,
        s.chain_3,
        at[6],
        s.cogging_1,
        s.cogging_2,
        x.load,
        s.load_1,
        start,
        s.start_1,
        x.u_dc,
        max(s.starting - 1, 0),
        voltages,
    )
    return following, Shown(seen.i_a, seen.i_b, seen.i_c, torque, omega_m, theta_m, theta_e)


def no_tables() -> Tables:
    """Zeros: a linear machine without harmonics."""
    line = np.zeros(POINTS, np.int64)
    return Tables(np.zeros((64, 64), np.int64), np.zeros((64, 64), np.int64), line, line.copy(), line.copy())
