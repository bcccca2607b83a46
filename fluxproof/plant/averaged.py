# SPDX-License-Identifier: BSD-3-Clause
"""Averaged plant: one voltage vector per period, from the duties and the inverter's voltage errors."""

from fluxproof.plant import layout as L
from fluxproof.plant.inverter import averaged_leg
from fluxproof.plant.jit import njit
from fluxproof.plant.kernel import accept, clear_means, refresh, sources, try_step
from fluxproof.plant.mechanics import IMPOSED_SPEED

_NONE = (0.0, 0.0, 0.0)


@njit
def advance_averaged(state, params, duties, u_dc, load, period_s, half=0):
    """Advance the state in place by one PWM period, or by half of one.

    duties: three indexable values, high time of the legs / period, clipped to 0..1.
    u_dc: bus voltage [V].  load: load torque [Nm], or in IMPOSED_SPEED mode the
    mechanical speed [rad/s] at the period's end, reached along a ramp.
    half: 0, or 1 and -1 if period_s is the rising or falling half of a PWM period (see `averaged_leg`).
    The voltage errors of the legs depend on the currents at the start of each sub-step.
    """
    inv = params.inverter
    acceleration = 0.0
    if params.mechanics.mode == IMPOSED_SPEED:
        acceleration = (load - state[L.OMEGA_M]) / period_s
        load_torque = 0.0
    else:
        load_torque = load
    d_a = min(max(duties[0], 0.0), 1.0)
    d_b = min(max(duties[1], 0.0), 1.0)
    d_c = min(max(duties[2], 0.0), 1.0)
    step_s = period_s / params.substeps
    clear_means(state)
    refresh(state, params)
    for _ in range(params.substeps):
        if inv.ideal:
            v, r = (d_a * u_dc, d_b * u_dc, d_c * u_dc), _NONE
        else:
            v_a, r_a = averaged_leg(inv, d_a, u_dc, state[L.I_A], period_s, half)
            v_b, r_b = averaged_leg(inv, d_b, u_dc, state[L.I_B], period_s, half)
            v_c, r_c = averaged_leg(inv, d_c, u_dc, state[L.I_C], period_s, half)
            v, r = (v_a, v_b, v_c), (r_a, r_b, r_c)
        drive = sources(state, params, v, r, state[L.TORQUE], load_torque, acceleration)
        accept(state, drive, try_step(state, params, drive, step_s), step_s, period_s)
        refresh(state, params)
    state[L.TIME] += period_s


@njit
def skewed_currents(state, params, skew_s):
    """Phase currents (a, b, c) [A] skew_s seconds after (before, if negative) the state.

    The PWM centre lies within a zero vector, so the machine is short-circuited
    around it: the currents change with their ripple slope, not with the mean slope.
    Valid while |skew_s| is less than half the zero vector.
    """
    drive = sources(state, params, _NONE, _NONE, state[L.TORQUE], state[L.TORQUE], 0.0)
    step = try_step(state, params, drive, skew_s)
    moved = state.copy()
    moved[L.LAMBDA_ALPHA], moved[L.LAMBDA_BETA] = step.lambda_alpha, step.lambda_beta
    moved[L.OMEGA_M], moved[L.THETA_M], moved[L.I_SHORT] = step.omega, step.theta, step.i_short
    refresh(moved, params)
    return moved[L.I_A], moved[L.I_B], moved[L.I_C]
