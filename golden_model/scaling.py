# SPDX-License-Identifier: BSD-3-Clause
"""The SI value of each register, and its scale: the SI value of 1.0 in the format of the register.

A scale is a product of the bases I, U, w (electrical speed), U/w (flux linkage) and the sample time T_s;
it follows from the block's equation.  Example: u = kp*i in per unit is u/U = kp*(I/U) * i/I, so 1.0 of kp
is U/I volts per ampere.

Regulators.  The current loops cancel the pole of R and L with the zero of the PI and cross over at
w_c:  kp = w_c*L_x,  ki = w_c*R.  The speed loop crosses over at w_s on the integrator
d(omega_me)/dt = 1.5*p**2*lambda_mg/J * i_q:  Kp = w_s*J/(1.5*p**2*lambda_mg), and Ki = Kp*w_s/5 puts the
corner of the integral a factor of five below the crossover, where it reduces the phase margin by 11 degrees
(atan(1/5)) and still removes a load step within a few times 5/w_s.

Flux estimator (docs/flux_estimator.md): the regulators' integrals follow an error of the decoupling with the
time constant (R + kp)/ki; K_p = w_f*(R + kp)/ki and K_i = w_f cancel it, and the compensation crosses over at
w_f.  Paper 001, section 4, requires w_f below the current loop's crossover and above the speed loop's: twice the
latter, since K_p multiplies noise, but at most half of the former, or a tenth of it without a speed loop.
The two models cross over at an eighth of the rated electrical speed, the range of the paper's experiments; the
compensation fades in from omega_min to half of that, because below it delta_lambda amplifies small voltage errors.

Sampling: currents and position are taken delay_s after the valley, the voltage acts at a fixed time after it, so the
angles from the sample to the voltage (k_delay, k_ahead) shrink by omega_me*delay_s; nothing else changes, see
docs/board.md.
"""

import math

from golden_model.formats import PU
from golden_model.mode_scaling import modes
from golden_model.motion import position_loop
from golden_model.protection_limits import protection
from golden_model.scale_entry import Entry, base_keys, leg_loss_v
from golden_model.units import TURN_RAD

INTEGRAL_CORNER = 5.0  # speed crossover over the corner of the speed regulator's integral
FLUX_OVER_SPEED, FLUX_OF_CURRENT, FLUX_ALONE = 2.0, 0.5, 0.1  # flux bandwidth over the others, see above
FADED_IN = 0.5  # of the crossover of the two flux models: full compensation from here on
CROSSOVER_PART = 8.0  # rated electrical speed over the crossover of the two flux models
COMPENSATION_PART = 0.5  # of the nominal flux: what the compensation may add or take
SIGN_OF_RATED, SIGN_GAIN = 0.005, 0.125  # |direction| = 1 from: part of rated current, or of leg loss / kp
LEARN_OF_RATED = 0.1  # of the rated current: the V_dead Adaline is held below
AHEAD_SAMPLES = 2.5  # from a sample to the middle of the next sample's voltage
THRESHOLD_OF_BASE = 2e-5  # of the voltage base: five of the format's steps
LOSS_MARGIN, LOSS_SPARE_V = (3.0, 3.0)  # largest compensation: factor on the leg loss by data sheet, device drops
PSI_STEP, PSI_FROM = (0.01, 0.1)  # 2*eta*omega**2 at rated speed; part of rated speed from which psi_m is estimated
ROUND_UP = ("dead_time", "min_pulse", "charge_samples")  # times that must not be shorter than specified


def sensing(drive):
    """Codes to per-unit currents, bus voltage and position; codes count in the converter's own LSB."""
    s, b = drive.sensors, drive.bases
    mid = 2.0 ** (s.adc_bits - 1)
    for phase, code, trim in zip("abc", s.current_offset_code or (mid,) * 3, s.current_gain, strict=True):
        yield Entry(f"offset_{phase}", code, "code", mid, "[sensors] adc_bits, current_offset_code")
        keys = f"[sensors] current_range_a, current_gain; {base_keys(drive, 'current_a')}"
        yield Entry(f"gain_{phase}", trim * s.current_range_a, "A", b.current_a, keys)
    keys = "[sensors] current_sensors; [converters] currents"
    yield Entry("two_sensors", int(drive.current_sensors == 2), "1", 1.0, keys)
    yield Entry("u_dc_offset", s.u_dc_offset_code, "code", mid, "[sensors] adc_bits, u_dc_offset_code")
    keys = f"[sensors] u_dc_range_v, u_dc_gain; {base_keys(drive, 'voltage_v')}"
    yield Entry("u_dc_gain", s.u_dc_gain * s.u_dc_range_v / 2.0, "V", b.voltage_v, keys)
    k_u_max = drive.fundamental * (1.0 - drive.control.voltage_reserve) / math.sqrt(3.0)
    yield Entry("k_u_max", k_u_max, "1", 1.0, "[control] voltage_reserve, voltage_fundamental")
    keys = "[machine] pole_pairs; [sensors] position_pole_pairs"
    yield Entry("pole_pairs", drive.code_pairs, "1", 1.0, keys)
    yield Entry("reverse", int(s.position_reverse), "1", 1.0, "[sensors] position_reverse")
    yield Entry("theta_offset", s.theta_offset_rad % TURN_RAD, "rad", TURN_RAD, "[sensors] theta_offset_rad")


def speed_loop(drive):
    """Speed from position codes, its filter and the speed regulator (gains zero without a bandwidth)."""
    c, m, b, t_s = drive.control, drive.machine, drive.bases, drive.sample_time_s
    base = base_keys(drive, "omega_me_rad_s")
    k_speed = TURN_RAD * drive.code_pairs / t_s  # electrical rad/s per turn of the code and sample
    yield Entry("k_speed", k_speed, "rad/s", b.omega_me_rad_s, f"[inverter] pwm_frequency_hz; {base}")
    base = base_keys(drive, "current_a", "omega_me_rad_s")
    k_filter = 1.0 if c.speed_filter_hz is None else -math.expm1(-TURN_RAD * c.speed_filter_hz * t_s)
    yield Entry("k_filter", k_filter, "1", 1.0, "[control] speed_filter_hz")
    yield Entry("speed_given", 0, "1", 1.0, "none: 1 takes the speed from omega_given")
    keys = f"none: a speed measured elsewhere; {base_keys(drive, 'omega_me_rad_s')}"
    yield Entry("omega_given", 0.0, "rad/s", b.omega_me_rad_s, keys)
    yield Entry("position_restart", 0, "1", 1.0, "none: 1 for a sample whose code jumps")
    kp, ki = speed_gains(drive)
    keys = "[machine] inertia_kgm2, magnet_flux_wb, pole_pairs; [control] speed_bandwidth_hz"
    kp_keys = keys if c.speed_kp_as_per_rad is None else "[control] speed_kp_as_per_rad"
    ki_keys = keys if c.speed_ki_a_per_rad is None else "[control] speed_ki_a_per_rad"
    per_speed, what = b.current_a / b.omega_me_rad_s, "A"
    if drive.core.references:  # the regulator's output is a torque then
        per_ampere = 1.5 * m.pole_pairs * m.magnet_flux_wb
        kp, ki, per_speed, what = kp * per_ampere, ki * per_ampere, drive.torque_base_nm / b.omega_me_rad_s, "Nm"
    yield Entry("speed_kp", kp, f"{what} s/rad", per_speed, f"{kp_keys}; {base}")
    yield Entry("speed_ki", ki, f"{what}/rad", per_speed / t_s, f"{ki_keys}; {base}")
    # After a change of modes the proportional part moves as i_step; a step below one LSB would never end.
    ampere = speed_gains(drive)[0] * b.omega_me_rad_s  # at a speed error of one per unit
    change = max(min(drive.current_limit_a * t_s / (c.mode_change_s * ampere), 1.0) if ampere else 1.0, PU.lsb)
    keys = f"[control] mode_change_s, current_limit_a, speed_bandwidth_hz; {base_keys(drive, 'omega_me_rad_s')}"
    yield Entry("omega_step", change * b.omega_me_rad_s, "rad/s", b.omega_me_rad_s, keys)
    limit = "[machine] rated_current_a" if c.current_limit_a is None else "[control] current_limit_a"
    yield Entry("i_max", drive.current_limit_a, "A", b.current_a, f"{limit}; {base_keys(drive, 'current_a')}")


def speed_gains(drive):
    """(Kp [A s/rad], Ki [A/rad]) of the speed regulator, per electrical speed and angle."""
    c, m = drive.control, drive.machine
    kp = ki = 0.0
    if c.speed_bandwidth_hz is not None:
        w_s = TURN_RAD * c.speed_bandwidth_hz
        kp = w_s * m.inertia_kgm2 / (1.5 * m.pole_pairs**2 * m.magnet_flux_wb)
        ki = kp * w_s / INTEGRAL_CORNER
    kp = kp if c.speed_kp_as_per_rad is None else c.speed_kp_as_per_rad
    ki = ki if c.speed_ki_a_per_rad is None else c.speed_ki_a_per_rad
    return kp, ki


def current_loop(drive):
    """Current regulators, flux model of the decoupling, advance of the output angle."""
    c, m, b, t_s = drive.control, drive.machine, drive.bases, drive.sample_time_s
    ohm = b.voltage_v / b.current_a
    base = base_keys(drive, "current_a", "voltage_v")
    for axis in "dq":
        henry = getattr(m, f"inductance_{axis}_h")
        kp, ki = current_gains(drive, axis)
        kp_key = f"[control] current_bandwidth_hz; [machine] inductance_{axis}_h"
        ki_key = "[control] current_bandwidth_hz; [machine] resistance_ohm"
        if getattr(c, f"current_kp_{axis}_v_per_a") is not None:
            kp_key = f"[control] current_kp_{axis}_v_per_a"
        if getattr(c, f"current_ki_{axis}_v_per_as") is not None:
            ki_key = f"[control] current_ki_{axis}_v_per_as"
        yield Entry(f"kp_{axis}", kp, "V/A", ohm, f"{kp_key}; {base}")
        yield Entry(f"ki_{axis}", ki, "V/(A s)", ohm / t_s, f"{ki_key}; {base}")
        keys = f"[machine] inductance_{axis}_h; {base}; {base_keys(drive, 'omega_me_rad_s')}"
        yield Entry(f"l_{axis}", henry, "H", b.flux_wb / b.current_a, keys)
    w_c = min(current_gains(drive, axis)[0] / getattr(m, f"inductance_{axis}_h") for axis in "dq")
    keys = f"[control] current_bandwidth_hz, current_kp_d_v_per_a; {base_keys(drive, 'omega_me_rad_s')}"
    yield Entry("k_ripple", min(w_c, 1.9 * b.omega_me_rad_s), "rad/s", b.omega_me_rad_s, keys)
    keys = f"[machine] magnet_flux_wb; {base_keys(drive, 'voltage_v', 'omega_me_rad_s')}"
    yield Entry("lambda_mg", m.magnet_flux_wb, "Wb", b.flux_wb, keys)
    keys = "[control] delay_samples; [sampling] delay_s; [inverter] pwm_frequency_hz"
    keys = f"{keys}; {base_keys(drive, 'omega_me_rad_s')}"
    yield Entry("k_delay", drive.sampling_to_voltage_s, "s", TURN_RAD / b.omega_me_rad_s, keys)


def current_gains(drive, axis):
    """(kp [V/A], ki [V/(A s)]) of one axis' current regulator."""
    c, m = drive.control, drive.machine
    w_c = TURN_RAD * c.current_bandwidth_hz
    kp, ki = getattr(c, f"current_kp_{axis}_v_per_a"), getattr(c, f"current_ki_{axis}_v_per_as")
    kp = w_c * getattr(m, f"inductance_{axis}_h") if kp is None else kp
    return kp, w_c * m.resistance_ohm if ki is None else ki


def flux_bandwidth_hz(drive):
    """Crossover of the compensation by delta_lambda [Hz]."""
    c = drive.control
    if c.flux_bandwidth_hz is not None:
        return c.flux_bandwidth_hz
    if c.speed_bandwidth_hz is None:
        return FLUX_ALONE * c.current_bandwidth_hz
    return min(FLUX_OVER_SPEED * c.speed_bandwidth_hz, FLUX_OF_CURRENT * c.current_bandwidth_hz)


def flux_gains(drive):
    """(K_p [1], K_i [1/s]) of paper 001 eq. (17)."""
    c, resistance = drive.control, drive.machine.resistance_ohm
    gains = [current_gains(drive, axis) for axis in "dq"]
    delays = [(resistance + kp) / ki if ki else math.inf for kp, ki in gains]
    w_f = TURN_RAD * flux_bandwidth_hz(drive)
    kp = w_f * sum(delays) / len(delays) if c.flux_kp is None else c.flux_kp
    return kp, w_f if c.flux_ki_per_s is None else c.flux_ki_per_s


def flux_estimator(drive):
    """Merge of the flux models, compensation by delta_lambda, chord of a sample."""
    c, m, b, t_s = drive.control, drive.machine, drive.bases, drive.sample_time_s
    speed_base, sample = base_keys(drive, "omega_me_rad_s"), "[inverter] pwm_frequency_hz"
    keys = f"[machine] resistance_ohm; {base_keys(drive, 'current_a', 'voltage_v')}"
    yield Entry("r_s", m.resistance_ohm, "ohm", b.voltage_v / b.current_a, keys)
    yield Entry("t_s", t_s, "s", 1.0 / b.omega_me_rad_s, f"{sample}; {speed_base}")
    inverse_speed = 1.0 / b.omega_me_rad_s
    yield Entry("k_chord", t_s * t_s / 24.0, "s2", inverse_speed * inverse_speed, f"{sample}; {speed_base}")
    given = c.flux_crossover_hz
    omega_0 = m.pole_pairs * m.rated_speed_rad_s / CROSSOVER_PART if given is None else TURN_RAD * given
    keys = "[machine] pole_pairs, rated_speed_rad_s" if given is None else "[control] flux_crossover_hz"
    yield Entry("omega_0", omega_0, "rad/s", 1.0 / t_s, f"{keys}; {sample}")
    yield Entry("xi", c.flux_damping, "1", 1.0, "[control] flux_damping")
    omega_min, keys = m.pole_pairs * c.flux_min_speed_rad_s, f"[control] flux_min_speed_rad_s; {speed_base}"
    yield Entry("omega_min", omega_min, "rad/s", b.omega_me_rad_s, keys)
    ramp = max(FADED_IN * omega_0 - omega_min, omega_min)
    yield Entry("k_ramp", 1.0 / ramp, "s/rad", 1.0 / b.omega_me_rad_s, keys)
    kp, ki = flux_gains(drive)
    keys = "[control] flux_bandwidth_hz, current_bandwidth_hz, speed_bandwidth_hz"
    yield Entry("flux_kp", kp, "1", 1.0, keys if c.flux_kp is None else "[control] flux_kp")
    ki_keys = keys if c.flux_ki_per_s is None else "[control] flux_ki_per_s"
    yield Entry("flux_ki", ki, "1/s", 1.0 / t_s, f"{ki_keys}; {sample}")
    limit, keys = c.flux_compensation_limit_wb, "[control] flux_compensation_limit_wb"
    if limit is None:
        limit = COMPENSATION_PART * drive.nominal_flux_wb
        keys = "[machine] magnet_flux_wb, inductance_q_h, rated_current_a"
    yield Entry("delta_max", limit, "Wb", b.flux_wb, f"{keys}; {base_keys(drive, 'voltage_v', 'omega_me_rad_s')}")
    yield Entry("flux_mode", c.flux_mode, "1", 1.0, "[control] flux_mode")


def vsi_estimators(drive):
    """Dead-time voltage, its compensation, winding temperature and magnet flux: paper 000."""
    c, m, b, t_s = drive.control, drive.machine, drive.bases, drive.sample_time_s
    volts, amperes, speed = (base_keys(drive, k) for k in ("voltage_v", "current_a", "omega_me_rad_s"))
    zone, keys = c.sign_current_a, "[control] sign_current_a"
    if zone is None:
        kp = min(current_gains(drive, axis)[0] for axis in "dq") or math.inf
        zone = max(SIGN_OF_RATED * m.rated_current_a, SIGN_GAIN * leg_loss_v(drive) / kp)
        keys = "[machine] rated_current_a; [inverter] dead_time_s; [control] current_bandwidth_hz"
    yield Entry("k_sign", 1.0 / zone, "1/A", 1.0 / b.current_a, f"{keys}; {amperes}")
    ahead, keys = AHEAD_SAMPLES * t_s - drive.sampling.delay_s, "[sampling] delay_s; [inverter] pwm_frequency_hz"
    yield Entry("k_ahead", ahead, "s", 1.0 / b.omega_me_rad_s, f"{keys}; {speed}")
    k_lp = -math.expm1(-TURN_RAD * c.v_dead_filter_hz * t_s)
    yield Entry("k_lp", k_lp, "1", 1.0, "[control] v_dead_filter_hz; [inverter] pwm_frequency_hz")
    yield Entry("eta_v", 18.0 * c.v_dead_eta, "1", 1.0, "[control] v_dead_eta")
    yield Entry("gamma", c.v_dead_gamma, "1", 1.0, "[control] v_dead_gamma")
    yield Entry("zeta", c.v_dead_zeta, "1", 1.0, "[control] v_dead_zeta")
    least = THRESHOLD_OF_BASE * b.voltage_v if c.v_dead_threshold_v is None else c.v_dead_threshold_v
    yield Entry("v_thr", least, "V", b.voltage_v, f"[control] v_dead_threshold_v; {volts}")
    most = LOSS_MARGIN * leg_loss_v(drive) + LOSS_SPARE_V if c.v_dead_limit_v is None else c.v_dead_limit_v
    keys = (
        "[inverter] dead_time_s, pwm_frequency_hz, dc_bus_v" if c.v_dead_limit_v is None else "[control] v_dead_limit_v"
    )
    yield Entry("v_comp_max", most, "V", b.voltage_v, f"{keys}; {volts}")
    start, keys = c.v_dead_start_v, "[control] v_dead_start_v"
    if start is None:  # from the data where a torque must be right from the first second
        wanted = (drive.core.references or drive.core.position_loop) and c.dead_time_compensation
        start = leg_loss_v(drive) if wanted else 0.0
        keys = "[core] references, position_loop; [inverter] dead_time_s, pwm_frequency_hz, dc_bus_v"
    yield Entry("v_start", min(start, most), "V", b.voltage_v, f"{keys}; {volts}")
    least, keys = LEARN_OF_RATED * m.rated_current_a, "[machine] rated_current_a"
    yield Entry("i_learn", least, "A", b.current_a, f"{keys}; {amperes}")
    yield Entry("compensate", int(c.dead_time_compensation), "1", 1.0, "[control] dead_time_compensation")
    omega_b, keys = b.omega_me_rad_s, "[control] psi_eta"
    eta = psi_eta(drive)
    yield Entry("eta_psi", 2.0 * eta, "s2/rad2", 1.0 / omega_b / omega_b, f"{keys}; {speed}")
    least = c.psi_min_speed_rad_s
    least = PSI_FROM * m.rated_speed_rad_s if least is None else least
    yield Entry("omega_psi_min", m.pole_pairs * least, "rad/s", omega_b, f"[control] psi_min_speed_rad_s; {speed}")
    keys = "[machine] resistance_ohm, resistance_temp_coeff_per_k"
    tcr = m.resistance_ohm * m.resistance_temp_coeff_per_k
    yield Entry("tcr", tcr, "ohm/K", b.voltage_v / b.current_a, f"{keys}; {volts}; {amperes}")
    yield Entry("t_0", m.temperature_ref_c, "degC", 1.0, "[machine] temperature_ref_c")
    yield Entry("t_min", c.winding_temp_min_c, "degC", 1.0, "[control] winding_temp_min_c")
    yield Entry("t_max", c.winding_temp_max_c, "degC", 1.0, "[control] winding_temp_max_c")


def psi_eta(drive):
    """eta of paper 000 eq. (13) [s2/rad2]; by default 2*eta*omega**2 = 0.01 at the rated speed."""
    rated = drive.machine.pole_pairs * drive.machine.rated_speed_rad_s
    return PSI_STEP / 2.0 / rated / rated if drive.control.psi_eta is None else drive.control.psi_eta


def gates(drive):
    """Times of the gate signals in clocks, and how often they are updated."""
    i, clock_s = drive.inverter, 1.0 / drive.core.clock_hz
    keys = "min_pulse_s" if i.min_on_time_s is None else "min_on_time_s, dead_time_s"
    yield Entry("dead_time", i.dead_time_s, "s", clock_s, "[inverter] dead_time_s; [core] clock_hz")
    yield Entry("min_pulse", i.leg_pulse_s, "s", clock_s, f"[inverter] {keys}; [core] clock_hz")
    keys = "[inverter] bootstrap_charge_s, pwm_frequency_hz"
    yield Entry("charge_samples", i.bootstrap_charge_s, "s", drive.sample_time_s, keys)
    yield Entry("double_update", drive.core.updates_per_period - 1, "1", 1.0, "[core] updates_per_period")


PARTS = (sensing, speed_loop, current_loop, flux_estimator, vsi_estimators, gates, position_loop, modes, protection)
