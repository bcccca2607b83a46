# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of both plants: parameters, outputs, and a step of the whole drive."""

import math
from typing import NamedTuple

from fluxproof.plant import layout as L
from fluxproof.plant.integrator import Drive, observe, rk4_step
from fluxproof.plant.inverter import InverterParams
from fluxproof.plant.jit import njit
from fluxproof.plant.mechanics import FREE, MechanicsParams, shaft_drive, stop_at_zero
from fluxproof.plant.pmsm import MachineParams, magnet_flux
from fluxproof.plant.transforms import clarke, inverse_clarke, phase_matrix


class PlantParams(NamedTuple):
    """All parameters of a drive, for the kernels."""

    machine: MachineParams
    mechanics: MechanicsParams
    inverter: InverterParams
    substeps: int  # Runge-Kutta steps per period (averaged plant)
    max_step_s: float  # longest Runge-Kutta step (switching plant) [s]


@njit
def sources(state, params, legs_v, legs_r, torque, load, acceleration):
    """Collect what is constant during a step into a Drive.

    legs_v, legs_r: Thevenin sources of the three legs, tuples [V], [ohm].
    load: load torque [Nm]; acceleration: imposed [rad/s^2].
    """
    m, mech = params.machine, params.mechanics
    hot = 1.0 + m.resistance_temp_coeff * (state[L.TEMP_WINDING] - m.temperature_ref)
    r_aa, r_ab, r_bb = phase_matrix(hot * m.resistance[0], hot * m.resistance[1], hot * m.resistance[2])
    s_aa, s_ab, s_bb = phase_matrix(legs_r[0], legs_r[1], legs_r[2])
    u_alpha, u_beta = clarke(legs_v[0], legs_v[1], legs_v[2])
    psi_m = magnet_flux(m, state[L.TEMP_MAGNET])
    free, friction = 0.0, 0.0
    if mech.mode == FREE:
        free, friction = shaft_drive(mech, state[L.OMEGA_M], torque, load)
    winding = hot * m.resistance[m.shorted_phase] * m.shorted_share * (1.0 - m.shorted_share)
    short = m.shorted_resistance + winding
    return Drive(psi_m, u_alpha, u_beta, r_aa, r_ab, r_bb, s_aa, s_ab, s_bb, free, friction, load, acceleration, short)


@njit
def try_step(state, params, drive, step_s):
    """Step from the state without changing it; returns a Step."""
    return rk4_step(
        params.machine,
        params.mechanics,
        drive,
        step_s,
        (state[L.LAMBDA_ALPHA], state[L.LAMBDA_BETA], state[L.OMEGA_M], state[L.THETA_M], state[L.I_SHORT]),
        state[L.I_D],
        state[L.I_Q],
    )


@njit
def accept(state, drive, step, step_s, period_s):
    """Write a Step into the state and add its contribution to the means of the period."""
    omega, theta = stop_at_zero(drive.friction, state[L.OMEGA_M], state[L.THETA_M], step.omega, step.theta, step_s)
    state[L.LAMBDA_ALPHA] = step.lambda_alpha
    state[L.LAMBDA_BETA] = step.lambda_beta
    state[L.OMEGA_M] = omega
    state[L.THETA_M] = theta
    state[L.I_SHORT] = step.i_short
    share = step_s / period_s
    state[L.U_ALPHA] += share * (drive.u_alpha - drive.s_aa * step.i_alpha - drive.s_ab * step.i_beta)
    state[L.U_BETA] += share * (drive.u_beta - drive.s_ab * step.i_alpha - drive.s_bb * step.i_beta)
    state[L.I_ALPHA_MEAN] += share * step.i_alpha
    state[L.I_BETA_MEAN] += share * step.i_beta
    state[L.P_IN] += share * step.p_in
    state[L.P_COPPER] += share * step.p_copper
    state[L.P_AIRGAP] += share * step.p_airgap


@njit
def clear_means(state):
    """Start a new period: zero the means."""
    for k in range(L.U_ALPHA, L.P_AIRGAP + 1):
        state[k] = 0.0


@njit
def refresh(state, params):
    """Write the outputs (currents, dq flux, torque, angle) that follow from the state."""
    m = params.machine
    psi_m = magnet_flux(m, state[L.TEMP_MAGNET])
    i_alpha, i_beta, i_d, i_q, torque, l_d, l_q, _, _ = observe(
        m,
        psi_m,
        state[L.LAMBDA_ALPHA],
        state[L.LAMBDA_BETA],
        state[L.OMEGA_M],
        state[L.THETA_M],
        state[L.I_SHORT],
        state[L.I_D],
        state[L.I_Q],
    )
    state[L.I_A], state[L.I_B], state[L.I_C] = inverse_clarke(i_alpha, i_beta)
    state[L.I_D], state[L.I_Q] = i_d, i_q
    state[L.LAMBDA_D], state[L.LAMBDA_Q] = l_d, l_q
    state[L.TORQUE] = torque
    state[L.THETA_E] = (m.pole_pairs * state[L.THETA_M]) % (2.0 * math.pi)
