# SPDX-License-Identifier: BSD-3-Clause
"""The registers of the protection, as golden_model/scaling.py does for the others.

The default limits lie outside the range of a healthy drive: overcurrent at twice the current limit, the sum of the
currents at a fifth of the rated current, the bus at a tenth and 1.3 times its nominal value, no sample for 1.5 periods,
1.2 times the rated speed, a tenth of it against the reference for 20 ms without braking (with Hall sensors for a sector
longer), a sensor that shows 1 % of the rated current at rest, a stall of 0.1 s, an encoder that contradicts the EMF for
2.8 ms or 1.4 over the bandwidth of the current loop. An open load is reported and does not trip. The position may
deviate from its linear extrapolation by 5e-4 turn plus four codes, or four counts of an incremental encoder: no shaft
accelerates that much within a sample, and a frozen code is detected from that rotation per sample on.
"""

import math

from golden_model.estimators import motor_residual
from golden_model.formats import LIMIT, PU
from golden_model.io.emf_check import EMF_I, EMF_L, EMF_MIN, EMF_W, MEAN
from golden_model.io.emf_check import SAMPLES as EMF_SAMPLES
from golden_model.io.fault_latch import NAMES
from golden_model.io.motion_checks import AWAY as AWAY_COUNT
from golden_model.io.motion_checks import WAY_LIMIT
from golden_model.io.offset_check import OFFSET
from golden_model.scale_entry import Entry, base_keys, leg_loss_v
from golden_model.units import TURN_RAD

TRIP_OF_LIMIT, TRIP_OF_RANGE = 2.0, 0.98  # overcurrent: of the current limit, at most of the sensors' range
SUM_OF_RATED = 0.2  # of the rated current: a larger sum of the phase currents is a sensor fault
BUS_LOW, BUS_HIGH = 0.1, 1.3  # of the nominal bus voltage
RUNAWAY_S = 0.02  # against the reference without braking; with Hall sensors a sector at that speed more
OVERSPEED, AWAY, STANDS = 1.2, 0.1, 0.01  # of the rated speed: trips; looked for a runaway; the shaft stands below
OPEN_OF_RATED, OFFSET_OF_RATED = 0.02, 0.01  # of the rated current: of a connected phase; of a sensor at rest
BRAKE_HYSTERESIS = 0.97  # of the voltage that switches the brake resistor on: off below
JUMP_CODES, JUMP_TURN = 4, 5e-4  # of the position, per sample: quantisation of the code, and noise of the sensor
# The EMF may be wrong by: of that at rated speed; of the voltage of dead time and devices, a six-step vector of 4/3 of
# the leg's; of R*i, for a hot winding; of the flux; of L*i at the limit.  Hall sensors: 30 degrees within a sector.
EMF_OF_RATED, EMF_OF_LEG, EMF_OF_R, EMF_OF_PSI, EMF_OF_LI, EMF_OF_PSI_HALL = 0.02, 1.6, 0.5, 0.3, 0.3, 0.8
# So long at least; over the current loop's bandwidth; with Hall sensors; sectors in that time, whose EMF is not seen
EMF_S, EMF_OF_LOOP, EMF_HALL_S, EMF_SECTORS = 2.8e-3, 1.4, 0.05, 1.0
# The mean residual of a described motor: of the EMF at rated speed; of the voltage of dead time and devices; of R*i; of
# the flux; of L*i at the limit; the sum of the currents: of the rated one, of each current; a light load: of
# the rated current; the angle that a mean covers
RESIDUAL_OF_RATED, RESIDUAL_OF_LEG, RESIDUAL_OF_R, RESIDUAL_OF_PSI, RESIDUAL_OF_LI = 0.002, 0.07, 0.06, 0.021, 0.015
SUM_OF_RESIDUAL, SUM_OF_CURRENT, LIGHT, SECTOR = 0.004, 0.001, 0.1, math.pi / 3.0
WORKING = "[machine] rated_current_a; [control] current_limit_a"
ALWAYS_REPORTED = ("trip", "early")  # the pin always trips, a rejected sample never does


def protection(drive):
    """Trip levels and ignored faults: see golden_model/io."""
    p, s, b = drive.protection, drive.sensors, drive.bases
    amperes, volts = base_keys(drive, "current_a"), base_keys(drive, "voltage_v")
    limit, bus = drive.current_limit_a, drive.inverter.dc_bus_v
    keys = "[machine] rated_current_a" if drive.control.current_limit_a is None else "[control] current_limit_a"
    most = max(limit, min(TRIP_OF_LIMIT * limit, TRIP_OF_RANGE * s.current_range_a))
    yield _limit("i_trip", p.current_trip_a, most, "A", b.current_a, "current_trip_a", keys, amperes)
    keys, most = WORKING, SUM_OF_RATED * drive.working_current_a
    yield _limit("sum_trip", p.current_sum_trip_a, most, "A", b.current_a, "current_sum_trip_a", keys, amperes)
    yield Entry("rail_samples", p.rail_samples, "1", 1.0, "[protection] rail_samples")
    keys = "[inverter] dc_bus_v"
    yield _limit("u_dc_min", p.u_dc_min_v, BUS_LOW * bus, "V", b.voltage_v, "u_dc_min_v", keys, volts)
    most = default_u_dc_max_v(drive)
    yield _limit("u_dc_max", p.u_dc_max_v, most, "V", b.voltage_v, "u_dc_max_v", keys, volts)
    finest, keys = 2.0**s.position_bits, "[sensors] position_bits"
    if drive.encoder.counts is not None:
        finest, keys = float(drive.encoder.counts), "[encoder] counts"
    jump = JUMP_CODES / finest + s.position_pole_pairs * JUMP_TURN  # turns of the code
    if p.position_jump_rad is not None:
        jump, keys = s.position_pole_pairs * p.position_jump_rad / TURN_RAD, "[protection] position_jump_rad"
    yield Entry("jump_max", jump, "turn", 1.0, keys)
    trips = [name in ALWAYS_REPORTED or getattr(p, f"trip_{name}") for name in NAMES]
    ignored = sum((not trip) << bit for bit, trip in enumerate(trips))
    yield Entry("fault_ignore", ignored, "1", 1.0, "[protection] trip_...")
    keys = "[protection] watchdog_periods; [inverter] pwm_frequency_hz; [core] clock_hz"
    yield Entry("watchdog", p.watchdog_periods * drive.sample_time_s, "s", 1.0 / drive.core.clock_hz, keys)
    yield from motion_limits(drive)
    yield from emf_limits(drive)
    yield from residual_limits(drive)
    yield from brake_limits(drive)
    yield from regeneration_line(drive)


def emf_limits(drive):
    """By how much the voltage may contradict angle and speed, and for how long."""
    p, b, m, i, t_s = drive.protection, drive.bases, drive.machine, drive.inverter, drive.sample_time_s
    hall, scale, sample = drive.encoder.kind == "hall", b.voltage_v / b.current_a, "[inverter] pwm_frequency_hz"
    volts, key = p.encoder_lost_v, "[protection] encoder_lost_v"
    if volts is None:
        volts = EMF_OF_RATED * m.magnet_flux_wb * m.pole_pairs * m.rated_speed_rad_s + EMF_OF_LEG * leg_loss_v(drive)
        if hall:  # a sector may last as long before its edge shows the speed
            volts += EMF_SECTORS * math.pi / 3.0 / EMF_HALL_S * m.magnet_flux_wb
        key = "[machine] magnet_flux_wb, rated_speed_rad_s; [inverter] dead_time_s"
    yield _fitting("emf_min", volts, "V", b.voltage_v, EMF_MIN, key)
    henry, keys = (m.inductance_d_h + m.inductance_q_h) / 2.0, "[machine] inductance_d_h, inductance_q_h"
    yield _fitting("emf_l", henry / (2**MEAN * t_s), "ohm", scale, EMF_L, f"{keys}; {sample}")
    ohm = EMF_OF_R * m.resistance_ohm + max(i.r_switch_ohm, i.r_diode_ohm)
    yield _fitting("emf_i", ohm, "ohm", scale, EMF_I, "[machine] resistance_ohm; [inverter] r_switch_ohm, r_diode_ohm")
    flux = (EMF_OF_PSI_HALL if hall else EMF_OF_PSI) * m.magnet_flux_wb
    flux += EMF_OF_LI * max(m.inductance_d_h, m.inductance_q_h) * drive.current_limit_a
    yield _fitting("emf_w", flux, "Wb", b.flux_wb, EMF_W, f"[machine] magnet_flux_wb; {keys}")
    lasts = p.encoder_lost_s
    if lasts is None:
        lasts = EMF_HALL_S if hall else max(EMF_S, EMF_OF_LOOP / (drive.control.current_bandwidth_hz or math.inf))
        lasts = min(lasts, EMF_SAMPLES.hi * t_s)
    yield Entry("emf_samples", lasts, "s", t_s, f"[protection] encoder_lost_s; {sample}")


def residual_limits(drive):
    """By how much the motor may differ from its description, and for how long; fluxes are voltages times T_s."""
    p, b, m, i, t_s = drive.protection, drive.bases, drive.machine, drive.inverter, drive.sample_time_s
    volts, key, sample = p.residual_v, "[protection] residual_v", "[inverter] pwm_frequency_hz"
    if volts is None:
        volts = RESIDUAL_OF_RATED * m.magnet_flux_wb * m.pole_pairs * m.rated_speed_rad_s
        volts += RESIDUAL_OF_LEG * leg_loss_v(drive)
        key = "[machine] magnet_flux_wb, rated_speed_rad_s; [inverter] dead_time_s"
    f = motor_residual
    leg, drops = leg_loss_v(drive), "[inverter] dead_time_s, pwm_frequency_hz, dc_bus_v, v_switch_v, v_diode_v"
    yield Entry("residual_leg", min(leg, f.V_LEVEL.hi * f.V_LEVEL.lsb * b.voltage_v), "V", b.voltage_v, drops)
    yield _fitting("residual_min", volts * t_s, "Wb", b.flux_wb, f.LEAST, f"{key}; {sample}")
    flux = RESIDUAL_OF_PSI * m.magnet_flux_wb
    flux += RESIDUAL_OF_LI * max(m.inductance_d_h, m.inductance_q_h) * drive.current_limit_a
    keys = f"[machine] magnet_flux_wb, inductance_d_h, inductance_q_h; {sample}"
    yield _fitting("residual_w", flux * t_s, "Wb s/rad", b.flux_wb / b.omega_me_rad_s, f.OF_OMEGA, keys)
    ohm = RESIDUAL_OF_R * (m.resistance_ohm + max(i.r_switch_ohm, i.r_diode_ohm))
    keys = f"[machine] resistance_ohm; [inverter] r_switch_ohm, r_diode_ohm; {sample}"
    yield _fitting("residual_i", ohm * t_s, "H", b.flux_wb / b.current_a, f.OF_I, keys)
    keys = WORKING
    yield Entry("residual_light", LIGHT * drive.working_current_a, "A", b.current_a, keys)
    slow, speed = SECTOR / (2**f.MEAN * t_s), base_keys(drive, "omega_me_rad_s")
    most = PU.hi * PU.lsb * b.omega_me_rad_s
    yield Entry("residual_slow", min(slow, most), "rad/s", b.omega_me_rad_s, f"{sample}; {speed}")
    yield _fitting("residual_sum_max", SUM_OF_RESIDUAL * drive.working_current_a, "A", b.current_a, f.SUM_LEAST, keys)
    yield Entry("residual_sum_i", SUM_OF_CURRENT, "1", 1.0, "none: a share of the current")
    lasts = min(p.residual_s, f.SAMPLES.hi * t_s)
    yield Entry("residual_samples", lasts, "s", t_s, f"[protection] residual_s; {sample}")


def _fitting(name, value, unit, base, fmt, keys):
    """A value of ``base`` in ``fmt``, clipped to its range: a limit that nothing reaches, or that all reach."""
    return Entry(name, min(max(value, fmt.lsb * base), fmt.hi * fmt.lsb * base), unit, base, keys)


def motion_limits(drive):
    """Overspeed, runaway, stall, open load, zero of the current sensors, heartbeat of the host."""
    p, b, m, t_s = drive.protection, drive.bases, drive.machine, drive.sample_time_s
    pairs, rated = m.pole_pairs, m.rated_speed_rad_s
    speed, amperes = base_keys(drive, "omega_me_rad_s"), base_keys(drive, "current_a")
    for name, key, part in (
        ("omega_trip", "overspeed_rad_s", OVERSPEED),
        ("omega_away", "runaway_rad_s", AWAY),
        ("omega_stall", "standstill_rad_s", STANDS),
    ):
        given = getattr(p, key)
        given = None if given is None else pairs * given
        keys = "[machine] pole_pairs, rated_speed_rad_s"
        yield _limit(name, given, part * rated * pairs, "rad/s", b.omega_me_rad_s, key, keys, speed)
    sample, away = "[inverter] pwm_frequency_hz", p.runaway_s
    if away is None:
        away, late = RUNAWAY_S, AWAY * rated * pairs if p.runaway_rad_s is None else p.runaway_rad_s * pairs
        if drive.encoder.kind == "hall":  # the speed is that of the sector before: a braked shaft seems to speed up
            away = min(away + SECTOR / late, AWAY_COUNT.hi * t_s)
    yield Entry("runaway_samples", away, "s", t_s, f"[protection] runaway_s; {sample}")
    yield Entry("stall_samples", p.stall_s, "s", t_s, f"[protection] stall_s; {sample}")
    stands = STANDS * rated if p.standstill_rad_s is None else p.standstill_rad_s
    key = "[protection] standstill_rad_s, stall_s; [machine] rated_speed_rad_s"
    yield _fitting("way_stall", pairs * stands * p.stall_s / 2.0, "rad", b.omega_me_rad_s * t_s, WAY_LIMIT, key)
    keys = WORKING
    least = OPEN_OF_RATED * drive.working_current_a
    yield _limit("i_open", p.open_load_a, least, "A", b.current_a, "open_load_a", keys, amperes)
    most, key = p.current_offset_a, "[protection] current_offset_a"
    if most is None:
        step = OFFSET.lsb * b.current_a
        most, key = min(max(OFFSET_OF_RATED * drive.working_current_a, step), OFFSET.hi * step), keys
    yield Entry("offset_max", most, "A", b.current_a, f"{key}; {amperes}")
    yield Entry("heartbeat", p.heartbeat_s, "s", t_s, f"[protection] heartbeat_s; {sample}")


def brake_limits(drive):
    """Bus voltages that switch the brake resistor; zero without one."""
    p, b, volts = drive.protection, drive.bases, base_keys(drive, "voltage_v")
    on, off = p.brake_on_v or 0.0, p.brake_off_v
    off, key = (BRAKE_HYSTERESIS * on, "brake_on_v") if off is None else (off, "brake_off_v")
    yield Entry("brake_on", on, "V", b.voltage_v, f"[protection] brake_on_v; {volts}")
    yield Entry("brake_off", off, "V", b.voltage_v, f"[protection] {key}; {volts}")


def regeneration_line(drive):
    """The braking current falls from the current limit at regen_start_v to none at regen_end_v; slope 0: no limit."""
    p, b = drive.protection, drive.bases
    volts, per_volt = base_keys(drive, "voltage_v"), b.current_a / b.voltage_v
    slope = 0.0 if p.regen_start_v is None else drive.current_limit_a / (regen_end_v(drive) - p.regen_start_v)
    yield Entry("regen_start", p.regen_start_v or 0.0, "V", b.voltage_v, f"[protection] regen_start_v; {volts}")
    keys = f"[protection] regen_start_v, regen_end_v; {base_keys(drive, 'current_a', 'voltage_v')}"
    yield Entry("regen_slope", slope, "A/V", per_volt, keys)


def default_u_dc_max_v(drive):
    """The bus voltage that trips u_dc_high where u_dc_max_v does not give it [V]."""
    bus = drive.inverter.dc_bus_v
    return max(bus, min(BUS_HIGH * bus, TRIP_OF_RANGE * drive.sensors.u_dc_range_v))


def regen_end_v(drive):
    """The bus voltage that leaves no braking current, of a drive with regen_start_v [V]."""
    p = drive.protection
    return p.regen_end_v or (p.regen_start_v + (p.u_dc_max_v or default_u_dc_max_v(drive))) / 2.0


def _limit(name, given, default, unit, base, key, default_keys, base_names):
    """A limit in 1/256 of its base, as given, or the default clipped to the range of the format."""
    if given is not None:
        return Entry(name, given, unit, base, f"[protection] {key}; {base_names}")
    default = min(max(default, LIMIT.lsb * base), LIMIT.hi * LIMIT.lsb * base)
    return Entry(name, default, unit, base, f"{default_keys}; {base_names}")
