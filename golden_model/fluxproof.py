# SPDX-License-Identifier: BSD-3-Clause
"""The whole core, one sample at a time: twin of rtl/fluxproof.vhd.

Raw sample -> conditioning -> transforms -> control -> modulation -> compare values.  What runs
at every clock (sample guard, fault latch, gate generation) is in golden_model/clocked.py.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model import estimation
from golden_model.block import Port
from golden_model.control import (
    chord_speed,
    current_limit,
    current_pi,
    current_reference,
    dead_time_compensation,
    decoupling,
    flux_limit,
    gear,
    mode_change,
    mode_references,
    position_control,
    position_trajectory,
    reference_table,
    regeneration_limit,
    ripple_voltage,
    speed_pi,
    torque_correction,
    torque_ramp,
    voltage_limit,
    voltage_loop,
)
from golden_model.control.dead_time_compensation import D_D, D_Q
from golden_model.estimators import (
    applied_voltage,
    clean_voltage,
    current_directions,
    current_model,
    delta_lambda,
    direction_current,
    flux_compensation,
    flux_estimate,
    flux_merge,
    flux_models,
    flux_monitor,
    motor_residual,
    psi_adaline,
    speed_reciprocal,
    torque,
    v_dead_adaline,
    voltage_ripple,
    winding_resistance,
)
from golden_model.estimators.flux_models import CURRENT_MODEL
from golden_model.fixed import Format, saturate
from golden_model.formats import PU, PU_W
from golden_model.io import (
    brake_chopper,
    current_conditioning,
    emf_check,
    fault_latch,
    host_watch,
    load_check,
    motion_checks,
    offset_check,
    position,
    sample_checks,
    sample_guard,
    sample_latch,
    speed,
    u_dc_conditioning,
    u_dc_processing,
)
from golden_model.kernel import kernel
from golden_model.modulation import (
    bootstrap_charge,
    gate_generation,
    overmodulation,
    pwm_compare,
    svm,
    svm_delay_compensation,
)
from golden_model.transforms import clarke, flux_inverse_park, flux_park, inverse_park, park, sincos

# Instance of the top -> (its block, the instances it waits for).  A block starts when the last of them is done.
WIRING = {
    "latch": (sample_latch, ()),
    "conditioning": (current_conditioning, ("latch",)),
    "angle": (position, ("latch",)),
    "speed_measurement": (speed, ("latch",)),
    "bus_voltage": (u_dc_conditioning, ("latch",)),
    "bus_reciprocal": (u_dc_processing, ("bus_voltage",)),
    "stator_frame": (clarke, ("conditioning",)),
    "delay": (svm_delay_compensation, ("angle", "speed_measurement")),
    "trig": (sincos, ("angle", "delay")),
    "rotor_frame": (park, ("stator_frame", "trig")),
    "current_circle": (current_limit, ("latch",)),
    "modes": (mode_change, ("latch",)),
    "table_current": (current_reference, ("current_circle",)),
    "position_regulator": (position_control, ("latch",)),
    "master_gear": (gear, ("latch",)),
    "trajectory": (position_trajectory, ("position_regulator", "master_gear")),
    "speed_regulator": (speed_pi, ("speed_measurement", "current_circle", "position_regulator", "modes")),
    "regeneration": (regeneration_limit, ("speed_regulator", "bus_voltage")),
    "flux_circle": (flux_limit, ("speed_measurement", "bus_voltage")),
    "ramp": (torque_ramp, ("speed_regulator",)),
    "references": (reference_table, ("ramp", "flux_circle")),
    "current_regulators": (current_pi, ("rotor_frame", "regeneration", "current_circle")),
    "resistance": (winding_resistance, ("latch",)),
    "merged_flux": (flux_park, ("trig",)),
    "models": (flux_models, ("rotor_frame", "merged_flux", "resistance")),
    "flux": (flux_estimate, ("models",)),
    "chord": (chord_speed, ("speed_measurement",)),
    "cross_coupling": (decoupling, ("flux", "chord")),
    "leg_compensation": (dead_time_compensation, ("latch",)),
    "compensation_dq": (park, ("leg_compensation", "trig")),
    "direction_functions": (park, ("trig",)),
    "ripple_answer": (ripple_voltage, ("trig", "speed_measurement")),
    "circle": (
        voltage_limit,
        ("current_regulators", "cross_coupling", "compensation_dq", "bus_voltage", "ripple_answer"),
    ),
    "hexagon": (
        overmodulation,
        ("current_regulators", "cross_coupling", "compensation_dq", "bus_voltage", "ripple_answer", "bus_reciprocal"),
    ),
    "beginnings": (mode_references, ("circle",)),
    "stator_voltage": (inverse_park, ("circle", "trig")),
    "modulator": (svm, ("stator_voltage", "bus_reciprocal", "hexagon")),
    "compare": (pwm_compare, ("modulator",)),
    "period_voltage": (applied_voltage, ("bus_voltage",)),
    "motor_voltage": (clean_voltage, ("period_voltage",)),
    "ripple": (voltage_ripple, ("period_voltage", "trig")),
    "magnetic_model": (current_model, ("models",)),
    "model_flux": (flux_inverse_park, ("magnetic_model",)),
    "merge": (flux_merge, ("model_flux", "motor_voltage")),
    "speed_inverse": (speed_reciprocal, ("speed_measurement",)),
    "flux_error": (delta_lambda, ("speed_inverse", "circle")),
    "compensation": (flux_compensation, ("flux_error",)),
    "torque_estimate": (torque, ("flux",)),
    "voltage_regulator": (voltage_loop, ("circle",)),
    "map_correction": (torque_correction, ("references", "voltage_regulator", "torque_estimate")),
    "inverter_loss": (v_dead_adaline, ("circle", "direction_functions")),
    "magnet_flux": (psi_adaline, ("circle", "direction_functions")),
    "towards": (direction_current, ("regeneration", "current_circle", "stator_frame", "trig")),
    "directions": (current_directions, ("compensation_dq", "stator_frame", "speed_measurement", "towards")),
    "monitor": (flux_monitor, ("inverter_loss", "compensation", "merge", "bus_reciprocal")),
    "residual": (motor_residual, ("models",)),
    "checks": (sample_checks, ("conditioning", "bus_voltage")),
    "zero_check": (offset_check, ("conditioning", "speed_measurement")),
    "motion": (motion_checks, ("regeneration",)),
    "emf": (emf_check, ("circle",)),
    "load": (load_check, ("motion", "conditioning", "angle")),
    "chopper": (brake_chopper, ("bus_voltage",)),
}


# (instance, predecessor): clocks before the predecessor's out_valid at which the instance starts.  The first inputs
# come with the predecessor's out_soon, the others are declared late.
EARLY = {
    ("stator_frame", "conditioning"): 1,
    ("rotor_frame", "stator_frame"): 1,
    ("trajectory", "position_regulator"): position_trajectory.LATE,
    ("trajectory", "master_gear"): position_trajectory.GEAR_LATE,
    ("bus_reciprocal", "bus_voltage"): u_dc_conditioning.AHEAD,
    ("period_voltage", "bus_voltage"): u_dc_conditioning.AHEAD,
    ("checks", "bus_voltage"): u_dc_conditioning.AHEAD,
    ("trig", "delay"): sincos.SECOND,
    ("rotor_frame", "trig"): sincos.SECOND,
    ("merged_flux", "trig"): sincos.SECOND,
    ("current_regulators", "rotor_frame"): 1,
    ("current_regulators", "regeneration"): 1,
    ("models", "rotor_frame"): 1,
    ("models", "merged_flux"): 2,
    ("ripple_answer", "trig"): sincos.SECOND,
    ("circle", "current_regulators"): 1,
    ("circle", "compensation_dq"): 1,
    ("hexagon", "current_regulators"): 1,
    ("hexagon", "compensation_dq"): 1,
    ("hexagon", "bus_reciprocal"): overmodulation.LATE,
    ("stator_voltage", "circle"): 1,
}

AT_THE_CLOCK = (
    sample_guard,
    host_watch,
    fault_latch,
    bootstrap_charge,
    gate_generation,
)  # wired in golden_model/clocked.py
MODULES = (*dict.fromkeys(module for module, _ in WIRING.values()), *AT_THE_CLOCK)


def schedule() -> dict[str, tuple[int, int]]:
    """{instance: (first clock, last clock)} counted from the raw sample, from the declared latencies alone."""
    times: dict[str, tuple[int, int]] = {}
    for instance, (module, awaited) in WIRING.items():
        first = max((times[name][1] - EARLY.get((instance, name), 0) for name in awaited), default=0)
        times[instance] = (first, first + module.BLOCK.latency)
    return times


# Blocks whose outputs the top renames; the others' outputs already have the names of their use.
RENAMED = {
    "speed_regulator": ("torque_ref", "speed_limited"),
    "compensation_dq": ("u_comp_d", "u_comp_q"),
    "direction_functions": ("d_d", "d_q"),
}


def outputs_of(instance: str) -> tuple[str, ...]:
    """The names at the top of an instance's outputs, in the order of its block's."""
    return RENAMED.get(instance, tuple(p.name for p in WIRING[instance][0].BLOCK.outputs))


SAMPLE_TO_DUTY = schedule()["modulator"][1]
SAMPLE_INTERVAL = max(last for _, last in schedule().values()) + 1  # no sample enters while one is in flight

REGISTERS = {p.name: p for module in MODULES for p in module.BLOCK.registers}
Registers = namedtuple("Registers", list(REGISTERS))

# Generic -> the instances that only a core with it has, the narrowest part first
PARTS = {
    "references": ("flux_circle", "ramp", "references", "voltage_regulator", "map_correction", "table_current"),
    "gearing": ("master_gear",),
    "position_loop": ("position_regulator", "trajectory", "towards"),
    "modes": ("modes", "beginnings"),
    "residual": ("residual",),
    "overmodulation": ("ripple_answer", "hexagon", "ripple"),
}
PARTS["estimators"] = (
    *("resistance", "merged_flux", "leg_compensation", "compensation_dq", "direction_functions", "period_voltage"),
    *("motor_voltage", "towards", "directions", "magnetic_model", "model_flux", "merge", "speed_inverse", "flux_error"),
    *("compensation", "torque_estimate", "monitor", "inverter_loss", "magnet_flux", "residual", "ripple"),
)


def part_of(register: str) -> str:
    """The generic without which no instance reads this register; empty where every core has one that does."""
    readers = {name for name, (module, _) in WIRING.items() if register in {p.name for p in module.BLOCK.registers}}
    if any(register in {p.name for p in module.BLOCK.registers} for module in AT_THE_CLOCK):
        return ""
    return next((generic for generic, part in PARTS.items() if readers <= set(part)), "")


NEEDS = {name: part_of(name) for name in REGISTERS}


class Config(NamedTuple):
    """The generics of the top entity."""

    adc_bits: int = 16
    position_bits: int = 16
    carrier_half: int = 10000
    estimators: int = 1  # 0: field-oriented control alone
    references: int = 0  # 1: current references by a table of torque and flux limit
    position_loop: int = 0  # 1: a position loop over the speed loop, and its trajectory
    residual: int = 0  # 1: the residual of the motor beside its description, with the estimators
    modes: int = 0  # 1: voltage mode, and changes of mode without a step of the voltage
    overmodulation: int = 0  # 1: fundamentals up to six-step
    gearing: int = 0  # 1: the position loop can follow a second encoder


class Sample(NamedTuple):
    """Inputs of the core at one sampling instant; formats as in io/sample_latch."""

    adc_a: int
    adc_b: int
    adc_c: int
    adc_u_dc: int
    position_code: int
    omega_ref: int
    i_d_ref: int
    i_q_ext: int
    speed_mode: int
    temp_winding: int
    temp_valid: int
    clear_faults: int
    run: int


@kernel
def sample_of(row):
    """The Sample whose fields are the columns of ``row`` (13,), in their order."""
    return Sample(
        adc_a=row[0], adc_b=row[1], adc_c=row[2], adc_u_dc=row[3], position_code=row[4], omega_ref=row[5],
        i_d_ref=row[6], i_q_ext=row[7], speed_mode=row[8], temp_winding=row[9], temp_valid=row[10],
        clear_faults=row[11], run=row[12],
    )  # fmt: skip


class State(NamedTuple):
    of_speed: speed.State = speed.State()
    of_current_limit: current_limit.State = current_limit.State()
    of_speed_pi: speed_pi.State = speed_pi.State()
    of_current_pi: current_pi.State = current_pi.State()
    of_voltage_limit: voltage_limit.State = voltage_limit.State()
    of_flux_merge: flux_merge.State = flux_merge.State()
    of_delta_lambda: delta_lambda.State = delta_lambda.State()
    of_flux_compensation: flux_compensation.State = flux_compensation.State()
    of_flux_monitor: flux_monitor.State = flux_monitor.State()
    of_v_dead_adaline: v_dead_adaline.State = v_dead_adaline.State()
    of_psi_adaline: psi_adaline.State = psi_adaline.State()
    of_clean_voltage: clean_voltage.State = clean_voltage.State()
    of_sample_checks: sample_checks.State = sample_checks.State()
    of_offset_check: offset_check.State = offset_check.State()
    of_motion_checks: motion_checks.State = motion_checks.State()
    of_emf_check: emf_check.State = emf_check.State()
    of_load_check: load_check.State = load_check.State()
    of_brake_chopper: brake_chopper.State = brake_chopper.State()
    # Outputs that the next sample reads: the feedback paths of the top entity.
    sat_d: int = 0
    sat_q: int = 0
    compare_a: int = 0
    compare_b: int = 0
    compare_c: int = 0
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
    # Parts that a core may have; last, so that a state written by an older core is the beginning of one.
    i_d_table: int = 0
    i_q_table: int = 0
    torque_max: int = 0
    of_current_reference: current_reference.State = current_reference.State()
    of_torque_ramp: torque_ramp.State = torque_ramp.State()
    of_voltage_loop: voltage_loop.State = voltage_loop.State()
    of_torque_correction: torque_correction.State = torque_correction.State()
    share: int = voltage_loop.SHARE_HI >> voltage_loop.DROP_SHARE
    torque_gain: int = torque_correction.ONE >> torque_correction.DROP_GAIN
    regen_limited: int = 0
    of_regeneration_limit: regeneration_limit.State = regeneration_limit.State()
    # The position loop's part, last for the same reason
    of_position_control: position_control.State = position_control.State()
    of_position_trajectory: position_trajectory.State = position_trajectory.State()
    position_ref: int = 0
    omega_ff: int = 0
    torque_ff: int = 0
    at_rest: int = 0
    of_motor_residual: motor_residual.State = motor_residual.State()
    # The modes' part, likewise
    of_mode_change: mode_change.State = mode_change.State()
    of_mode_references: mode_references.State = mode_references.State()
    u_rest_d: int = 0
    u_rest_q: int = 0
    # The over-modulation's part, likewise
    of_overmodulation: overmodulation.State = overmodulation.State()
    of_voltage_ripple: voltage_ripple.State = voltage_ripple.State()
    u_alpha: int = 0
    u_beta: int = 0
    rip_alpha: int = 0
    rip_beta: int = 0
    # The gear's part, likewise
    of_gear: gear.State = gear.State()
    gear_free: int = 1
    at_stop: int = 0


class Observed(NamedTuple):
    """Every intermediate value at the ports of the top entity, in the order of the ports."""

    i_a: int
    i_b: int
    i_c: int
    current_at_rail: int
    u_dc: int
    u_max: int
    u_dc_at_rail: int
    u_dc_low: int
    theta_me: int
    omega_me: int
    i_d: int
    i_q: int
    i_q_ref: int
    speed_limited: int
    regen_limited: int
    lambda_d: int
    lambda_q: int
    omega_chord: int
    u_dec_d: int
    u_dec_q: int
    u_comp_d: int
    u_comp_q: int
    u_int_d: int
    u_int_q: int
    u_d: int
    u_q: int
    sat_d: int
    sat_q: int
    u_alpha: int
    u_beta: int
    duty_a: int
    duty_b: int
    duty_c: int
    u_applied_alpha: int
    u_applied_beta: int
    lambda_c_d: int
    lambda_c_q: int
    lambda_m_alpha: int
    lambda_m_beta: int
    merge_known: int
    delta_lambda_d: int
    delta_lambda_q: int
    delta_held: int
    lambda_pi_d: int
    lambda_pi_q: int
    torque: int
    flux_faults: int
    d_d: int
    d_q: int
    v_dead: int
    v_comp: int
    v_comp_limited: int
    psi_m: int
    psi_held: int
    temp_lost: int
    residual_d: int
    residual_q: int
    residual_mean_d: int
    residual_mean_q: int
    residual_sixth_d: int
    residual_sixth_q: int
    residual_power: int
    residual_sum: int
    motor_differs: int
    sample_faults: int
    sample_trip: int
    current_offset: int
    motion_faults: int
    open_load: int
    encoder_lost: int
    brake_asked: int
    speed_was_given: int
    position_restarted: int
    shaft_position: int
    position_error: int
    gear_way: int
    gear_engaged: int
    gear_stopped: int
    code_a: int
    code_b: int
    code_c: int
    code_u_dc: int
    code_theta: int
    compare_a: int
    compare_b: int
    compare_c: int


NOTHING_GIVEN, NOTHING_ESTIMATED = estimation.ForControl(), estimation.Estimated()


class Given(NamedTuple):
    """Registers that the front ends of a board set for each sample: what its speed came from, and whether the EMF can
    be checked.
    """

    speed_given: int
    omega_given: int
    position_restart: int
    emf_samples: int
    gear_code: int


@kernel
def given_by_registers(regs):
    """Given as the registers say it, without a front end."""
    return Given(
        speed_given=regs.speed_given, omega_given=regs.omega_given, position_restart=regs.position_restart,
        emf_samples=regs.emf_samples, gear_code=regs.gear_code,
    )  # fmt: skip


@kernel
def step(state, sample, regs, config):
    """One control period: (next state, Observed)."""
    return step_given(state, sample, regs, config, given_by_registers(regs))


@kernel
def step_given(state, sample, regs, config, of_speed):
    """One control period with ``of_speed`` in place of the registers: (next state, Observed)."""
    return step_table(state, sample, regs, config, of_speed, reference_table.BLANK)


@kernel
def step_table(state, sample, regs, config, of_speed, table):
    """One control period with a torque table, (2, SIZE) as reference_table: (next state, Observed)."""
    x, r, c = sample, regs, config
    i_a, i_b, i_c, current_at_rail = current_conditioning.step(
        x.adc_a, x.adc_b, x.adc_c, r.offset_a, r.offset_b, r.offset_c, r.gain_a, r.gain_b, r.gain_c, r.two_sensors,
        c.adc_bits,
    )  # fmt: skip
    (theta_me,) = position.step(x.position_code, r.reverse, r.pole_pairs, r.theta_offset, c.position_bits)
    speed_state, (omega_me, speed_was_given, position_restarted) = speed.step(
        state.of_speed, x.position_code, r.reverse, r.k_speed, r.k_filter, of_speed.position_restart,
        of_speed.speed_given, of_speed.omega_given, c.position_bits,
    )  # fmt: skip
    u_dc, u_max, u_dc_at_rail = u_dc_conditioning.step(x.adc_u_dc, r.u_dc_offset, r.u_dc_gain, r.k_u_max, c.adc_bits)
    inverse, inverse_beta, u_dc_low = u_dc_processing.step(u_dc)

    i_alpha, i_beta = clarke.step(i_a, i_b, i_c)
    (theta_out,) = svm_delay_compensation.step(theta_me, omega_me, r.k_delay)
    cos_theta, sin_theta, cos_out, sin_out = sincos.step(theta_me, theta_out)
    i_d, i_q = park.step(i_alpha, i_beta, cos_theta, sin_theta)

    given, flux_mode = NOTHING_GIVEN, CURRENT_MODEL
    if c.estimators:
        given = estimation.for_control(state, x, r, cos_theta, sin_theta, cos_out, sin_out)
        flux_mode = r.flux_mode
    by_table = c.references and r.use_table
    i_d_asked = state.i_d_table if by_table else x.i_d_ref
    modes_state, (by_voltage, take_over, follows) = state.of_mode_change, (0, 0, 0)
    i_d_source, i_q_used, torque_ff_used = i_d_asked, x.i_q_ext, state.torque_ff
    omega_source, by_speed = x.omega_ref, x.speed_mode
    begun = state.of_mode_references
    if c.modes:
        position_acts = 1 if c.position_loop and r.position_mode else 0
        modes_state, (by_voltage, take_over, follows) = mode_change.step(
            state.of_mode_change, x.speed_mode, position_acts, r.voltage_mode
        )
        torque_ff_used = state.torque_ff if position_acts else 0
        i_d_asked = begun.i_d_now if begun.hold_d else i_d_source
        i_q_used = begun.i_q_now if begun.hold_q or take_over else x.i_q_ext
        by_speed = 1 if x.speed_mode and not position_acts else 0
        omega_source = begun.omega_now if by_speed and begun.hold_omega else x.omega_ref
    current_limit_state, (i_d_limited, i_q_max) = current_limit.step(state.of_current_limit, i_d_asked, r.i_max)
    most = state.torque_max if by_table else i_q_max
    position_state, (shaft_position, position_error, omega_asked, regulates) = (
        state.of_position_control, (0, 0, omega_source, x.speed_mode),
    )  # fmt: skip
    if c.position_loop:
        position_state, (shaft_position, position_error, omega_asked, regulates) = position_control.step(
            state.of_position_control,
            position_control.Inputs(
                code_theta=x.position_code, position_ref=state.position_ref, omega_ff=state.omega_ff,
                at_rest=state.at_rest, omega_ref=omega_source, speed_mode=x.speed_mode,
            ),
            position_control.Registers(
                reverse=r.reverse, position_restart=of_speed.position_restart, position_mode=r.position_mode,
                position_kp=r.position_kp, position_band=r.position_band, omega_most=r.omega_most,
            ),
            c.position_bits,
        )  # fmt: skip
    speed_pi_state, (torque_ref, speed_limited) = speed_pi.step(
        state.of_speed_pi, omega_asked, omega_me, i_q_used, most, state.regen_limited, regulates, take_over, x.run,
        torque_ff_used, r.speed_kp, r.speed_ki,
    )  # fmt: skip
    i_q_asked, table_current_state = torque_ref, state.of_current_reference
    if c.references:
        table_current_state, (i_q_circle,) = current_reference.step(
            state.of_current_reference, state.i_q_table, i_q_max, r.use_table
        )
        i_q_asked = i_q_circle if by_table else torque_ref
    regeneration_state, (i_q_ref, regen_limited) = regeneration_limit.step(
        state.of_regeneration_limit, i_q_asked, omega_me, u_dc, r.i_max, r.regen_start, r.regen_slope
    )
    current_pi_state, (u_pi_d, u_pi_q, u_int_d, u_int_q) = current_pi.step(
        state.of_current_pi,
        current_pi.Inputs(
            i_d=i_d, i_q=i_q, i_d_ref=i_d_limited, i_q_ref=i_q_ref, sat_d=state.sat_d, sat_q=state.sat_q,
            u_rest_d=state.u_rest_d, u_rest_q=state.u_rest_q, follows=follows, by_voltage=by_voltage, run=x.run,
        ),
        r,
    )  # fmt: skip
    model_d, model_q, merged_d, merged_q, merged, ended = flux_models.step(
        i_d, i_q, given.lambda_m_d, given.lambda_m_q, state.merge_known, x.run, given.minus_rho, flux_mode, r.l_d,
        r.l_q, r.lambda_mg,
    )  # fmt: skip
    lambda_d, lambda_q, estimate_limited = flux_estimate.step(
        model_d, model_q, merged_d, merged_q, merged, ended, state.lambda_pi_d, state.lambda_pi_q
    )
    (omega_chord,) = chord_speed.step(omega_me, r.k_chord)
    u_dec_d, u_dec_q = decoupling.step(omega_chord, lambda_d, lambda_q)
    asked_d, asked_q, turned_d, turned_q = u_pi_d, u_pi_q, u_dec_d, u_dec_q
    if c.overmodulation:
        u_rip_d, u_rip_q = ripple_voltage.step(
            state.rip_alpha, state.rip_beta, cos_theta, sin_theta, omega_me, r.k_ripple
        )
        turned_d, turned_q = saturate(u_dec_d + u_rip_d, PU_W), saturate(u_dec_q + u_rip_q, PU_W)
    if by_voltage:
        asked_d, asked_q, turned_d, turned_q = begun.u_d_now, begun.u_q_now, 0, 0
    voltage_limit_state, (u_d, u_q, sat_d, sat_q) = voltage_limit.step(
        state.of_voltage_limit, asked_d, asked_q, turned_d, turned_q, given.u_comp_d, given.u_comp_q, u_max, lambda_d
    )

    u_alpha, u_beta = inverse_park.step(u_d, u_q, cos_out, sin_out)
    hexagon_state, inverse_used, inverse_beta_used = state.of_overmodulation, inverse, inverse_beta
    if c.overmodulation:
        hexagon_state, (inverse_used, inverse_beta_used) = overmodulation.step(
            state.of_overmodulation, u_d, asked_q, turned_q, given.u_comp_q, u_max, inverse, inverse_beta
        )
    duty_a, duty_b, duty_c = svm.step(u_alpha, u_beta, inverse_used, inverse_beta_used)
    compare_a, compare_b, compare_c = pwm_compare.step(
        duty_a, duty_b, duty_c, r.min_pulse, r.double_update, c.carrier_half
    )

    resumes = 1 if follows and not by_voltage else 0
    after, e = estimation.kept(state), NOTHING_ESTIMATED
    if c.estimators:
        towards_alpha, towards_beta = i_alpha, i_beta
        if c.position_loop:
            wanted = direction_current.Inputs(
                i_d_ref=i_d_limited, i_q_ref=i_q_ref, i_alpha=i_alpha, i_beta=i_beta, cos_theta=cos_theta,
                sin_theta=sin_theta, sat_d=state.sat_d, sat_q=state.sat_q, run=x.run,
            )  # fmt: skip
            towards_alpha, towards_beta = direction_current.step(wanted, r)
        seen = estimation.Seen(
            i_a=i_a, i_b=i_b, i_c=i_c, i_alpha=i_alpha, i_beta=i_beta, towards_alpha=towards_alpha,
            towards_beta=towards_beta, i_d=i_d, i_q=i_q,
            current_at_rail=current_at_rail, u_dc=u_dc,
            u_dc_at_rail=u_dc_at_rail, u_dc_low=u_dc_low, omega_me=omega_me, omega_chord=omega_chord,
            cos_theta=cos_theta, sin_theta=sin_theta, model_d=model_d, model_q=model_q, lambda_d=lambda_d,
            lambda_q=lambda_q, estimate_limited=estimate_limited, u_pi_d=u_pi_d, u_int_d=u_int_d, u_int_q=u_int_q,
            u_q=u_q, sat_d=sat_d, sat_q=sat_q, by_voltage=by_voltage,
            resumes=resumes,
        )  # fmt: skip
        after, e = estimation.step(state, given, seen, x, r, c)

    ramp_state, loop_state, correction_state = state.of_torque_ramp, state.of_voltage_loop, state.of_torque_correction
    i_d_table, i_q_table, torque_max, share, torque_gain = 0, 0, 0, state.share, state.torque_gain
    if c.references:
        (flux_part,) = flux_limit.step(omega_me, u_max, state.share, r.k_flux)
        loop_state, (share, calm) = voltage_loop.step(
            state.of_voltage_loop, u_max, x.run, u_d, u_q, r.u_share, r.k_voltage, r.share_min
        )
        ramp_state, (torque_now,) = torque_ramp.step(state.of_torque_ramp, torque_ref, x.run, r.torque_step)
        asked = reference_table.Inputs(flux_part=flux_part, torque_now=torque_now, torque_gain=state.torque_gain)
        i_d_table, i_q_table, torque_max, torque_limited = reference_table.step_table(asked, table)
        correction_state, (torque_gain,) = torque_correction.step(
            state.of_torque_correction, torque_now, e.torque, omega_me, torque_limited, calm, x.run, r.k_torque,
            r.omega_learn,
        )  # fmt: skip

    references_state, u_rest_d, u_rest_q = state.of_mode_references, 0, 0
    if c.modes:
        made = e.torque if by_table else i_q
        references_state, (_, _, _, _, _, _, _, _, u_rest_d, u_rest_q) = mode_references.step(
            state.of_mode_references,
            mode_references.Inputs(
                u_d=u_d, u_q=u_q, u_dec_d=u_dec_d, u_dec_q=u_dec_q, u_comp_d=given.u_comp_d, u_comp_q=given.u_comp_q,
                i_d=i_d, i_q_made=made, i_d_source=i_d_source, i_q_ext=x.i_q_ext, torque_ref=torque_ref,
                omega_me=omega_me, omega_ref=x.omega_ref, by_voltage=by_voltage, by_speed=by_speed, regulates=regulates,
                run=x.run,
            ),
            r,
        )  # fmt: skip

    gear_state, (gear_way, led, gear_engaged, gear_stopped) = state.of_gear, (0, 0, 0, 0)
    if c.position_loop and c.gearing:
        gear_state, (gear_way, led, gear_engaged, gear_stopped) = gear.step(
            state.of_gear,
            gear.Inputs(gear_free=state.gear_free, at_stop=state.at_stop),
            gear.Registers(
                gear_code=of_speed.gear_code, gear_on=r.gear_on, gear_numerator=r.gear_numerator,
                gear_denominator=r.gear_denominator, gear_step=r.gear_step, gear_lead=r.gear_lead,
                gear_smooth=r.gear_smooth,
            ),
        )  # fmt: skip
    trajectory_state, (position_ref, omega_ff, torque_ff, at_rest, gear_free, at_stop) = (
        state.of_position_trajectory, (0, 0, 0, 0, state.gear_free, state.at_stop),
    )  # fmt: skip
    if c.position_loop:
        trajectory_state, (position_ref, omega_ff, torque_ff, at_rest, gear_free, at_stop) = position_trajectory.step(
            state.of_position_trajectory,
            position_trajectory.Inputs(shaft_position=shaft_position, led=led, run=x.run),
            r,
        )

    checks_state, (sample_faults, sample_trip) = sample_checks.step(
        state.of_sample_checks,
        sample_checks.Inputs(
            i_a=i_a, i_b=i_b, i_c=i_c, current_at_rail=current_at_rail, u_dc=u_dc, u_dc_at_rail=u_dc_at_rail,
            code_theta=x.position_code,
        ),
        sample_checks.Registers(
            i_trip=r.i_trip, sum_trip=r.sum_trip, rail_samples=r.rail_samples, u_dc_min=r.u_dc_min,
            u_dc_max=r.u_dc_max, jump_max=r.jump_max, fault_ignore=r.fault_ignore,
            position_restart=of_speed.position_restart,
        ),
        c.position_bits,
    )  # fmt: skip
    offset_check_state, (current_offset,) = offset_check.step(
        state.of_offset_check, i_a, i_b, i_c, omega_me, x.run, r.omega_stall, r.offset_max
    )
    motion_checks_state, (motion_faults,) = motion_checks.step(
        state.of_motion_checks, omega_me, omega_asked, regulates, speed_limited, regen_limited, x.run, r.omega_trip,
        r.omega_away, r.runaway_samples, r.way_stall, r.stall_samples,
    )  # fmt: skip
    emf_check_state, (encoder_lost,) = emf_check.step(
        state.of_emf_check,
        emf_check.Inputs(
            u_d=u_d, u_q=u_q, u_comp_d=given.u_comp_d, u_comp_q=given.u_comp_q, i_d=i_d, i_q=i_q, model_d=model_d,
            model_q=model_q, omega_me=omega_me, run=x.run,
        ),
        emf_check.Registers(
            r_s=r.r_s, emf_min=r.emf_min, emf_l=r.emf_l, emf_i=r.emf_i, emf_w=r.emf_w, emf_samples=of_speed.emf_samples
        ),
    )  # fmt: skip
    load_check_state, (open_load,) = load_check.step(
        state.of_load_check, i_a, i_b, i_c, i_q_ref, theta_me, x.run, motion_faults, r.i_open
    )
    brake_chopper_state, (brake_asked,) = brake_chopper.step(state.of_brake_chopper, u_dc, r.brake_on, r.brake_off)

    following = State(
        of_speed=speed_state, of_current_limit=current_limit_state, of_speed_pi=speed_pi_state,
        of_current_pi=current_pi_state, of_voltage_limit=voltage_limit_state, of_flux_merge=after.of_flux_merge,
        of_delta_lambda=after.of_delta_lambda, of_flux_compensation=after.of_flux_compensation,
        of_flux_monitor=after.of_flux_monitor, of_v_dead_adaline=after.of_v_dead_adaline,
        of_psi_adaline=after.of_psi_adaline, of_clean_voltage=after.of_clean_voltage, of_sample_checks=checks_state,
        of_offset_check=offset_check_state, of_motion_checks=motion_checks_state,
        of_emf_check=emf_check_state, of_load_check=load_check_state,
        of_brake_chopper=brake_chopper_state, sat_d=sat_d, sat_q=sat_q, compare_a=compare_a, compare_b=compare_b,
        compare_c=compare_c, lambda_m_alpha=after.lambda_m_alpha, lambda_m_beta=after.lambda_m_beta,
        merge_known=after.merge_known, lambda_pi_d=after.lambda_pi_d, lambda_pi_q=after.lambda_pi_q,
        lambda_add_d=after.lambda_add_d, lambda_add_q=after.lambda_add_q, v_comp=after.v_comp, v_leg=after.v_leg,
        s_alpha=after.s_alpha, s_beta=after.s_beta, of_current_reference=table_current_state,
        of_torque_ramp=ramp_state, of_voltage_loop=loop_state, of_torque_correction=correction_state, share=share,
        torque_gain=torque_gain, i_d_table=i_d_table, i_q_table=i_q_table, torque_max=torque_max,
        regen_limited=regen_limited, of_regeneration_limit=regeneration_state,
        of_position_control=position_state, of_position_trajectory=trajectory_state, position_ref=position_ref,
        omega_ff=omega_ff, torque_ff=torque_ff, at_rest=at_rest,
        of_motor_residual=after.of_motor_residual, of_mode_change=modes_state, of_mode_references=references_state,
        u_rest_d=u_rest_d, u_rest_q=u_rest_q, of_overmodulation=hexagon_state,
        of_voltage_ripple=after.of_voltage_ripple, u_alpha=u_alpha, u_beta=u_beta,
        rip_alpha=after.rip_alpha, rip_beta=after.rip_beta, of_gear=gear_state, gear_free=gear_free,
        at_stop=at_stop,
    )  # fmt: skip
    return following, Observed(
        i_a=i_a, i_b=i_b, i_c=i_c, current_at_rail=current_at_rail, u_dc=u_dc, u_max=u_max, u_dc_at_rail=u_dc_at_rail,
        u_dc_low=u_dc_low, theta_me=theta_me, omega_me=omega_me, i_d=i_d, i_q=i_q, i_q_ref=i_q_ref,
        speed_limited=speed_limited, regen_limited=regen_limited, lambda_d=lambda_d, lambda_q=lambda_q,
        omega_chord=omega_chord, u_dec_d=u_dec_d, u_dec_q=u_dec_q, u_comp_d=e.u_comp_d, u_comp_q=e.u_comp_q,
        u_int_d=u_int_d, u_int_q=u_int_q, u_d=u_d, u_q=u_q,
        sat_d=sat_d, sat_q=sat_q, u_alpha=u_alpha, u_beta=u_beta, duty_a=duty_a, duty_b=duty_b, duty_c=duty_c,
        u_applied_alpha=e.u_applied_alpha, u_applied_beta=e.u_applied_beta, lambda_c_d=e.lambda_c_d,
        lambda_c_q=e.lambda_c_q, lambda_m_alpha=e.lambda_m_alpha, lambda_m_beta=e.lambda_m_beta,
        merge_known=e.merge_known, delta_lambda_d=e.delta_lambda_d, delta_lambda_q=e.delta_lambda_q,
        delta_held=e.delta_held, lambda_pi_d=e.lambda_pi_d, lambda_pi_q=e.lambda_pi_q, torque=e.torque,
        flux_faults=e.flux_faults, d_d=e.d_d, d_q=e.d_q, v_dead=e.v_dead, v_comp=e.v_comp,
        v_comp_limited=e.v_comp_limited, psi_m=e.psi_m, psi_held=e.psi_held, temp_lost=e.temp_lost,
        residual_d=e.residual_d, residual_q=e.residual_q, residual_mean_d=e.residual_mean_d,
        residual_mean_q=e.residual_mean_q, residual_sixth_d=e.residual_sixth_d, residual_sixth_q=e.residual_sixth_q,
        residual_power=e.residual_power, residual_sum=e.residual_sum, motor_differs=e.motor_differs,
        sample_faults=sample_faults, sample_trip=sample_trip, current_offset=current_offset,
        motion_faults=motion_faults, open_load=open_load, encoder_lost=encoder_lost, brake_asked=brake_asked,
        speed_was_given=speed_was_given,
        position_restarted=position_restarted, shaft_position=shaft_position, position_error=position_error,
        gear_way=gear_way, gear_engaged=gear_engaged, gear_stopped=gear_stopped,
        code_a=x.adc_a, code_b=x.adc_b, code_c=x.adc_c, code_u_dc=x.adc_u_dc,
        code_theta=x.position_code, compare_a=compare_a, compare_b=compare_b, compare_c=compare_c,
    )  # fmt: skip


OBSERVED = {
    p.name: p for module in (sample_latch, *MODULES) for p in module.BLOCK.outputs if p.name in Observed._fields
}
OBSERVED |= {p.name: p for p in (D_D, D_Q)}
OBSERVED["code_theta"] = Port("code_theta", Format(0, 0, 18), doc="position code, one mechanical turn")
OBSERVED |= {f"u_comp_{x}": Port(f"u_comp_{x}", PU, doc=f"compensation voltage, {x} axis") for x in "dq"}
