# SPDX-License-Identifier: BSD-3-Clause
"""The estimators beside the control: twin of ``estimation`` in rtl/fluxproof.vhd, which ESTIMATORS = 0 leaves out.

``for_control`` gives what the control takes from the estimates of the sample before, ``step`` the new estimates.
"""

from typing import NamedTuple

from golden_model.control import dead_time_compensation
from golden_model.estimators import (
    applied_voltage,
    clean_voltage,
    current_directions,
    current_model,
    delta_lambda,
    flux_compensation,
    flux_merge,
    flux_monitor,
    motor_residual,
    psi_adaline,
    speed_reciprocal,
    torque,
    v_dead_adaline,
    voltage_ripple,
    winding_resistance,
)
from golden_model.kernel import kernel
from golden_model.transforms import flux_inverse_park, flux_park, park

NO_RESIDUAL = (0,) * len(motor_residual.OUTPUTS)


class State(NamedTuple):
    """The estimators' part of fluxproof.State, under the same names."""

    of_flux_merge: flux_merge.State = flux_merge.State()
    of_delta_lambda: delta_lambda.State = delta_lambda.State()
    of_flux_compensation: flux_compensation.State = flux_compensation.State()
    of_flux_monitor: flux_monitor.State = flux_monitor.State()
    of_v_dead_adaline: v_dead_adaline.State = v_dead_adaline.State()
    of_psi_adaline: psi_adaline.State = psi_adaline.State()
    of_clean_voltage: clean_voltage.State = clean_voltage.State()
    # Outputs that the next sample reads: the feedback paths of the top entity.
    lambda_m_alpha: int = 0
    lambda_m_beta: int = 0
    merge_known: int = 0
    lambda_pi_d: int = 0
    lambda_pi_q: int = 0
    lambda_add_d: int = 0
    lambda_add_q: int = 0
    v_comp: int = 0
    v_leg: int = 0
    s_alpha: int = 0
    s_beta: int = 0
    of_motor_residual: motor_residual.State = motor_residual.State()
    of_voltage_ripple: voltage_ripple.State = voltage_ripple.State()
    rip_alpha: int = 0
    rip_beta: int = 0


class ForControl(NamedTuple):
    """What the control and the later estimators take: resistance, merged flux, compensation, direction functions."""

    r: int = 0
    rho: int = 0
    minus_rho: int = 0
    temp_lost: int = 0
    lambda_m_d: int = 0
    lambda_m_q: int = 0
    u_comp_d: int = 0
    u_comp_q: int = 0
    d_d: int = 0
    d_q: int = 0


class Seen(NamedTuple):
    """What the control knows of the sample when the estimators work; names as in fluxproof.step."""

    i_a: int
    i_b: int
    i_c: int
    i_alpha: int
    i_beta: int
    towards_alpha: int  # the current whose directions are compensated
    towards_beta: int
    i_d: int
    i_q: int
    current_at_rail: int
    u_dc: int
    u_dc_at_rail: int
    u_dc_low: int
    omega_me: int
    omega_chord: int
    cos_theta: int
    sin_theta: int
    model_d: int
    model_q: int
    lambda_d: int
    lambda_q: int
    estimate_limited: int
    u_pi_d: int
    u_int_d: int
    u_int_q: int
    u_q: int
    sat_d: int
    sat_q: int
    by_voltage: int  # 1: the regulators only follow, they show neither flux nor loss
    resumes: int  # 1: first sample after such


class Estimated(NamedTuple):
    """What the estimators show, in the order of the record estimated_t; zero without them."""

    u_comp_d: int = 0
    u_comp_q: int = 0
    u_applied_alpha: int = 0
    u_applied_beta: int = 0
    lambda_c_d: int = 0
    lambda_c_q: int = 0
    lambda_m_alpha: int = 0
    lambda_m_beta: int = 0
    merge_known: int = 0
    delta_lambda_d: int = 0
    delta_lambda_q: int = 0
    delta_held: int = 0
    lambda_pi_d: int = 0
    lambda_pi_q: int = 0
    torque: int = 0
    flux_faults: int = 0
    d_d: int = 0
    d_q: int = 0
    v_dead: int = 0
    v_comp: int = 0
    v_comp_limited: int = 0
    psi_m: int = 0
    psi_held: int = 0
    temp_lost: int = 0
    residual_d: int = 0
    residual_q: int = 0
    residual_mean_d: int = 0
    residual_mean_q: int = 0
    residual_sixth_d: int = 0
    residual_sixth_q: int = 0
    residual_power: int = 0
    residual_sum: int = 0
    motor_differs: int = 0


@kernel
def kept(state):
    """The estimators' part of fluxproof.State as it is."""
    s = state
    return State(
        of_flux_merge=s.of_flux_merge, of_delta_lambda=s.of_delta_lambda, of_flux_compensation=s.of_flux_compensation,
        of_flux_monitor=s.of_flux_monitor, of_v_dead_adaline=s.of_v_dead_adaline, of_psi_adaline=s.of_psi_adaline,
        of_clean_voltage=s.of_clean_voltage, lambda_m_alpha=s.lambda_m_alpha, lambda_m_beta=s.lambda_m_beta,
        merge_known=s.merge_known, lambda_pi_d=s.lambda_pi_d, lambda_pi_q=s.lambda_pi_q, lambda_add_d=s.lambda_add_d,
        lambda_add_q=s.lambda_add_q, v_comp=s.v_comp, v_leg=s.v_leg, s_alpha=s.s_alpha, s_beta=s.s_beta,
        of_motor_residual=s.of_motor_residual, of_voltage_ripple=s.of_voltage_ripple, rip_alpha=s.rip_alpha,
        rip_beta=s.rip_beta,
    )  # fmt: skip


@kernel
def for_control(state, sample, regs, cos_theta, sin_theta, cos_out, sin_out):
    """ForControl of this sample; ``state``: fluxproof.State."""
    x, r = sample, regs
    winding_r, rho, minus_rho, temp_lost = winding_resistance.step(
        x.temp_winding, x.temp_valid, r.r_s, r.tcr, r.t_0, r.t_min, r.t_max, r.t_s
    )
    lambda_m_d, lambda_m_q = flux_park.step(state.lambda_m_alpha, state.lambda_m_beta, cos_theta, sin_theta)
    u_comp_alpha, u_comp_beta = dead_time_compensation.step(state.v_comp, state.s_alpha, state.s_beta)
    u_comp_d, u_comp_q = park.step(u_comp_alpha, u_comp_beta, cos_out, sin_out)
    d_d, d_q = park.step(state.s_alpha, state.s_beta, cos_out, sin_out)
    return ForControl(
        r=winding_r, rho=rho, minus_rho=minus_rho, temp_lost=temp_lost, lambda_m_d=lambda_m_d, lambda_m_q=lambda_m_q,
        u_comp_d=u_comp_d, u_comp_q=u_comp_q, d_d=d_d, d_q=d_q,
    )  # fmt: skip


@kernel
def step(state, given, seen, sample, regs, config):
    """One control period: (State, Estimated); ``state``: fluxproof.State, ``given``: ForControl, ``seen``: Seen."""
    g, v, x, r = given, seen, sample, regs
    u_applied_alpha, u_applied_beta, voltage_known = applied_voltage.step(
        state.compare_a, state.compare_b, state.compare_c, v.u_dc, v.u_dc_at_rail, x.run, config.carrier_half
    )
    clean_state, (u_clean_alpha, u_clean_beta) = clean_voltage.step(
        state.of_clean_voltage, u_applied_alpha, u_applied_beta, state.s_alpha, state.s_beta, state.v_leg
    )
    s_alpha, s_beta = current_directions.step(v.towards_alpha, v.towards_beta, v.omega_me, r.k_ahead, r.k_sign)
    lambda_c_d, lambda_c_q, model_limited = current_model.step(
        v.model_d, v.model_q, state.lambda_add_d, state.lambda_add_q
    )
    lambda_c_alpha, lambda_c_beta = flux_inverse_park.step(lambda_c_d, lambda_c_q, v.cos_theta, v.sin_theta)
    merge_state, (lambda_m_alpha, lambda_m_beta, merge_known, merge_limited) = flux_merge.step(
        state.of_flux_merge,
        flux_merge.Inputs(
            i_alpha=v.i_alpha, i_beta=v.i_beta, lambda_c_alpha=lambda_c_alpha, lambda_c_beta=lambda_c_beta,
            u_applied_alpha=u_clean_alpha, u_applied_beta=u_clean_beta, voltage_known=voltage_known, run=x.run,
            rho=g.rho,
        ),
        r,
    )  # fmt: skip
    regulated, loss_shown = (0, 0) if v.by_voltage else (x.run, voltage_known)
    factor, n_omega = speed_reciprocal.step(v.omega_me, r.omega_min, r.k_ramp)
    delta_state, (delta_lambda_d, delta_lambda_q, delta_held, delta_limited) = delta_lambda.step(
        state.of_delta_lambda,
        delta_lambda.Inputs(
            u_int_d=v.u_int_d, u_int_q=v.u_int_q, i_d=v.i_d, i_q=v.i_q, sat_d=v.sat_d, sat_q=v.sat_q,
            current_at_rail=v.current_at_rail, voltage_known=voltage_known, run=regulated, factor=factor,
            n_omega=n_omega, r=g.r,
        ),
    )  # fmt: skip
    compensation_state, compensated = flux_compensation.step(
        state.of_flux_compensation, delta_lambda_d, delta_lambda_q, delta_held, state.lambda_pi_d, state.lambda_pi_q,
        v.resumes, r.flux_mode, r.flux_kp, r.flux_ki, r.delta_max,
    )  # fmt: skip
    lambda_pi_d, lambda_pi_q, lambda_add_d, lambda_add_q, compensation_limited = compensated
    (torque_me,) = torque.step(v.lambda_d, v.lambda_q, v.i_d, v.i_q)
    monitor_state, (flux_faults,) = flux_monitor.step(
        state.of_flux_monitor, v.current_at_rail, v.u_dc_at_rail, v.u_dc_low, model_limited, merge_limited,
        delta_limited, compensation_limited, v.estimate_limited, x.clear_faults,
    )  # fmt: skip
    v_dead_state, (v_dead, v_comp, v_leg, v_comp_limited) = v_dead_adaline.step(
        state.of_v_dead_adaline,
        v_dead_adaline.Inputs(
            u_pi_d=v.u_pi_d, d_d=g.d_d, i_d=v.i_d, i_q=v.i_q, sat_d=v.sat_d, sat_q=v.sat_q,
            current_at_rail=v.current_at_rail, voltage_known=loss_shown, run=x.run,
        ),
        r,
    )  # fmt: skip
    psi_state, (psi_m, psi_held) = psi_adaline.step(
        state.of_psi_adaline,
        psi_adaline.Inputs(
            u_q=v.u_q, d_q=g.d_q, v_leg=state.v_leg, i_d=v.i_d, i_q=v.i_q, r=g.r, omega_chord=v.omega_chord,
            sat_d=v.sat_d, sat_q=v.sat_q, current_at_rail=v.current_at_rail, voltage_known=voltage_known, run=x.run,
        ),
        r,
    )  # fmt: skip

    residual_state, residual = state.of_motor_residual, NO_RESIDUAL
    if config.residual:
        residual_state, residual = motor_residual.step(
            state.of_motor_residual,
            motor_residual.Inputs(
                model_d=v.model_d, model_q=v.model_q, cos_theta=v.cos_theta, sin_theta=v.sin_theta, i_a=v.i_a,
                i_b=v.i_b, i_c=v.i_c, i_alpha=v.i_alpha, i_beta=v.i_beta, i_d=v.i_d, i_q=v.i_q, omega_me=v.omega_me,
                u_applied_alpha=u_applied_alpha, u_applied_beta=u_applied_beta, s_alpha=state.s_alpha,
                s_beta=state.s_beta, rho=g.rho, sat_d=state.sat_d, sat_q=state.sat_q, voltage_known=voltage_known,
                current_at_rail=v.current_at_rail, run=x.run,
            ),
            r,
        )  # fmt: skip
    mean_d, mean_q, sixth_d, sixth_q = residual[2:6]
    ripple_state, rip_alpha, rip_beta = state.of_voltage_ripple, state.rip_alpha, state.rip_beta
    if config.overmodulation:
        ripple_state, (rip_alpha, rip_beta) = voltage_ripple.step(
            state.of_voltage_ripple,
            voltage_ripple.Inputs(
                u_applied_alpha=u_applied_alpha, u_applied_beta=u_applied_beta, voltage_known=voltage_known,
                u_alpha=state.u_alpha, u_beta=state.u_beta, cos_theta=v.cos_theta, sin_theta=v.sin_theta, run=x.run,
            ),
            r,
        )  # fmt: skip

    following = State(
        of_flux_merge=merge_state, of_delta_lambda=delta_state, of_flux_compensation=compensation_state,
        of_flux_monitor=monitor_state, of_v_dead_adaline=v_dead_state, of_psi_adaline=psi_state,
        of_clean_voltage=clean_state, lambda_m_alpha=lambda_m_alpha, lambda_m_beta=lambda_m_beta,
        merge_known=merge_known, lambda_pi_d=lambda_pi_d, lambda_pi_q=lambda_pi_q, lambda_add_d=lambda_add_d,
        lambda_add_q=lambda_add_q, v_comp=v_comp, v_leg=v_leg, s_alpha=s_alpha, s_beta=s_beta,
        of_motor_residual=residual_state, of_voltage_ripple=ripple_state, rip_alpha=rip_alpha, rip_beta=rip_beta,
    )  # fmt: skip
    return following, Estimated(
        u_comp_d=g.u_comp_d, u_comp_q=g.u_comp_q, u_applied_alpha=u_applied_alpha, u_applied_beta=u_applied_beta,
        lambda_c_d=lambda_c_d, lambda_c_q=lambda_c_q, lambda_m_alpha=lambda_m_alpha, lambda_m_beta=lambda_m_beta,
        merge_known=merge_known, delta_lambda_d=delta_lambda_d, delta_lambda_q=delta_lambda_q, delta_held=delta_held,
        lambda_pi_d=lambda_pi_d, lambda_pi_q=lambda_pi_q, torque=torque_me, flux_faults=flux_faults, d_d=g.d_d,
        d_q=g.d_q, v_dead=v_dead, v_comp=v_comp, v_comp_limited=v_comp_limited, psi_m=psi_m, psi_held=psi_held,
        temp_lost=g.temp_lost, residual_d=residual[0], residual_q=residual[1], residual_mean_d=mean_d,
        residual_mean_q=mean_q, residual_sixth_d=sixth_d, residual_sixth_q=sixth_q, residual_power=residual[6],
        residual_sum=residual[7], motor_differs=residual[8],
    )  # fmt: skip
