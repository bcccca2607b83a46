# SPDX-License-Identifier: BSD-3-Clause
"""[position] of drive.toml and the registers of the position loop, see docs/position.md.

What is not given is ordinary: a bandwidth of a quarter of the speed loop's, the rated speed, the acceleration of 80 %
of the rated torque (friction and the regulator need the rest), built up in 8 samples, a dead band of one count of the
encoder, no stops.
"""

import math
from dataclasses import dataclass

from golden_model.control import gear as gear_block
from golden_model.control.position_control import POSITION
from golden_model.control.position_plan import SECTION_BITS, WAY
from golden_model.drive_keys import DriveError, not_negative, positive, real, whole
from golden_model.encoders.turn_counter import COUNTS_MAX, COUNTS_MIN
from golden_model.formats import PU
from golden_model.protection_limits import OVERSPEED
from golden_model.scale_entry import Entry, base_keys
from golden_model.units import TURN_RAD

OF_RATED = 0.8  # torque of the acceleration
OF_SPEED_LOOP = 4.0  # speed bandwidth over position bandwidth
SPEED_MARGIN = 1.25  # largest speed reference over that of the trajectory
JERK_BITS_MOST, LEAD_MOST = 5, 7
GEAR_LATE = 5  # samples from the way of the gear to position_ref beside two moving means and torque_lead
SMOOTHER = 1  # samples of the mean speed over those of its lead: a count of the master moves it by one at most
SMOOTH_MOST, NUMERATOR = gear_block.SMOOTH_MOST, gear_block.NUMERATOR
_GEAR = {p.name: p.fmt for p in gear_block.REGISTERS}
DENOMINATOR, GEAR_STEP, GEAR_LEAD = _GEAR["gear_denominator"], _GEAR["gear_step"], _GEAR["gear_lead"]


@dataclass(frozen=True)
class Position:
    """[position], used with [core] position_loop = true; of the shaft, angles from the encoder's zero."""

    bandwidth_hz: float | None = positive("Hz", "position loop; a quarter of speed_bandwidth_hz if none", None)
    speed_rad_s: float | None = positive("rad/s", "largest of a move; rated speed if none", None)
    acceleration_rad_s2: float | None = positive(
        "rad/s2", "largest of a move; of 80 % of the rated torque if none", None
    )
    jerk_rad_s3: float | None = positive("rad/s3", "largest of a move; acceleration within 8 samples if none", None)
    dead_band_counts: float = not_negative("1", "error that is left at rest, counts of the encoder", 1.0, most=1000.0)
    stop_low_rad: float | None = real("rad", "soft end stop", None)
    stop_high_rad: float | None = real("rad", "soft end stop", None)
    torque_lead_samples: int | None = whole(0, LEAD_MOST, "of the torque before the position; calculated if none", None)
    gear_numerator: int | None = whole(
        -NUMERATOR.hi, NUMERATOR.hi, "turns of this shaft in gear_denominator turns of the master", None
    )
    gear_denominator: int = whole(1, DENOMINATOR.hi, "turns of the master", 1)
    gear_master_counts: int | None = whole(
        COUNTS_MIN, COUNTS_MAX, "counts a turn of a master at A/B pins of the board; none: gear_code", None
    )
    gear_ramp_s: float = not_negative("s", "time in which the gear reaches its ratio", 0.1, most=1000.0)
    gear_lead_samples: int | None = whole(
        0, GEAR_LEAD.hi, "of the gear at the master's mean speed; the delay of the trajectory if none", None
    )


def check_position(drive):
    """The position loop is over a speed loop; two stops or none."""
    p = drive.position
    if (p.stop_low_rad is None) != (p.stop_high_rad is None):
        given, missing = ("stop_low_rad", "stop_high_rad")[:: 1 if p.stop_high_rad is None else -1]
        raise DriveError(f"[position] {given} is given, {missing} is not: allowed is both or none")
    if p.stop_low_rad is not None and not p.stop_low_rad < p.stop_high_rad:
        raise DriveError(f"[position] stop_low_rad = {p.stop_low_rad:g} must be below stop_high_rad")
    if not drive.core.position_loop and p != Position():
        raise DriveError("[position] is given and [core] position_loop is not true: nothing would use it")
    top = drive.protection.overspeed_rad_s or OVERSPEED * drive.machine.rated_speed_rad_s
    if p.speed_rad_s is not None and not p.speed_rad_s < top:
        allowed = f"below {top:g} rad/s, where the drive trips: [protection] overspeed_rad_s"
        raise DriveError(f"[position] speed_rad_s = {p.speed_rad_s:g} is out of range: allowed is {allowed}")
    if drive.core.gearing and not drive.core.position_loop:
        raise DriveError("[core] gearing needs position_loop = true, which follows the gear")
    if p.gear_numerator is not None and not drive.core.gearing:
        raise DriveError("[position] gear_numerator is given and [core] gearing is not true: nothing would use it")
    if p.gear_master_counts is not None:
        if not drive.core.gearing:
            raise DriveError(
                "[position] gear_master_counts is given and [core] gearing is not true: nothing would use it"
            )
        if drive.encoder.kind == "code" and drive.converters.kind == "codes":
            raise DriveError("[position] gear_master_counts needs a board: [encoder] or [converters] with a kind")
    if not p.gear_numerator and drive.core.gearing:
        found = "missing" if p.gear_numerator is None else "0"
        raise DriveError(f"[position] gear_numerator is {found}: [core] gearing needs the ratio of the gear")
    if drive.core.position_loop and drive.control.speed_bandwidth_hz is None and p.bandwidth_hz is None:
        raise DriveError("[core] position_loop needs [control] speed_bandwidth_hz or [position] bandwidth_hz")


def fed_forward(drive):
    """What a torque [Nm] is as output of the speed regulator: itself with the torque table, else a current [A]."""
    m = drive.machine
    if drive.core.references:
        return 1.0
    return 1.0 / (1.5 * m.pole_pairs * m.magnet_flux_wb) if m.magnet_flux_wb else 0.0


def limits(drive):
    """(speed [rad/s], acceleration [rad/s2], jerk_bits) of a move."""
    p, m, t_s = drive.position, drive.machine, drive.sample_time_s
    speed = m.rated_speed_rad_s if p.speed_rad_s is None else p.speed_rad_s
    acceleration = p.acceleration_rad_s2
    if acceleration is None:
        rated = 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a
        if not rated or not m.inertia_kgm2:
            raise DriveError(
                "[position] acceleration_rad_s2 is missing: no magnet flux or no inertia to derive it from"
            )
        acceleration = OF_RATED * rated / m.inertia_kgm2
    if p.jerk_rad_s3 is None:
        return speed, acceleration, 0
    samples = 2.0 * acceleration / (p.jerk_rad_s3 * t_s)
    bits = max(0, math.ceil(math.log2(samples) - 1e-9) - SECTION_BITS)
    if bits > JERK_BITS_MOST:
        least = 2.0 * acceleration / (t_s * (1 << (SECTION_BITS + JERK_BITS_MOST)))
        longest = 1 << (SECTION_BITS + JERK_BITS_MOST)
        raise DriveError(
            f"[position] jerk_rad_s3 = {p.jerk_rad_s3:g} is out of range: allowed is {least:g} or more, which takes "
            f"{longest} samples, the most, to reach {acceleration:g} rad/s2; a lower acceleration_rad_s2 allows less"
        )
    return speed, acceleration, bits


def torque_lead(drive):
    """Samples by which the current is late at a ramp, and the one over which position differences take a torque."""
    if drive.position.torque_lead_samples is not None:
        return drive.position.torque_lead_samples
    lag = 1.0 + 1.0 / (TURN_RAD * drive.control.current_bandwidth_hz * drive.sample_time_s)
    return min(round(lag), LEAD_MOST)


def gear_ratio(drive):
    """(numerator, denominator) as registers: as large as they fit, so that the numerator in force has small steps."""
    p = drive.position
    shared = math.gcd(p.gear_numerator, p.gear_denominator)
    numerator, denominator = p.gear_numerator // shared, p.gear_denominator // shared
    times = DENOMINATOR.hi // denominator
    if numerator:
        times = min(times, NUMERATOR.hi // abs(numerator))
    return numerator * times, denominator * times


def gear_delay(drive):
    """Samples by which the trajectory, and with it the shaft, is late to the way of the gear."""
    return (2 << (SECTION_BITS + limits(drive)[2])) + torque_lead(drive) + GEAR_LATE


def gear(drive):
    """The registers of the gear: name, value, unit, scale, keys; all zero without one."""
    on, p = drive.core.gearing, drive.position
    numerator, denominator = gear_ratio(drive) if on else (0, 1)
    given = p.gear_lead_samples
    lead = 0 if not on else gear_delay(drive) if given is None else given
    smooth = min(math.ceil(math.log2(SMOOTHER * max(lead, 1))), SMOOTH_MOST) if on else 0
    samples = max(1.0, p.gear_ramp_s / drive.sample_time_s)
    step = max(abs(numerator) / samples, GEAR_STEP.lsb)
    keys = "[position] gear_numerator, gear_denominator"
    yield Entry("gear_code", 0.0, "turn", 1.0, "none: a front end, or the host, gives the master's code")
    yield Entry("gear_on", 0, "1", 1.0, "none: 1 for a gear to the master, in position mode")
    yield Entry("gear_numerator", numerator, "1", 1.0, keys)
    yield Entry("gear_denominator", denominator, "1", 1.0, keys)
    yield Entry("gear_step", step, "1", 1.0, f"{keys}, gear_ramp_s; [inverter] pwm_frequency_hz")
    keys = "[position] gear_lead_samples, torque_lead_samples, jerk_rad_s3"
    yield Entry("gear_lead", lead, "1", 1.0, keys)
    yield Entry("gear_smooth", smooth, "1", 1.0, keys)


def count_turns(drive):
    """A count of the encoder in turns of the shaft: its own or that of the position code, the larger one."""
    lines = drive.encoder.counts
    return max(2.0**-drive.sensors.position_bits, 1.0 / lines if lines else 0.0)


def position_loop(drive):
    """The registers of position_control and position_trajectory; all zero without a position loop."""
    on, p, m, t_s = drive.core.position_loop, drive.position, drive.machine, drive.sample_time_s
    base = base_keys(drive, "omega_me_rad_s")
    speed, acceleration, bits = limits(drive) if on else (0.0, 0.0, 0)
    c, omega_b = drive.control, drive.bases.omega_me_rad_s
    bandwidth = p.bandwidth_hz or (c.speed_bandwidth_hz or 0.0) / OF_SPEED_LOOP
    yield Entry("position_mode", 0, "1", 1.0, "none: 1 for position control")
    yield Entry("position_target", 0.0, "turn", 1.0, "none: the position to go to")
    keys = f"[position] bandwidth_hz; [control] speed_bandwidth_hz; {base}"
    yield Entry("position_kp", on * TURN_RAD * bandwidth, "1/s", omega_b / (TURN_RAD * m.pole_pairs), keys)
    band = p.dead_band_counts * count_turns(drive)
    yield Entry("position_band", on * band, "turn", 1.0, "[position] dead_band_counts; [sensors] position_bits")
    most = min(SPEED_MARGIN * speed * m.pole_pairs, PU.hi * PU.lsb * omega_b)
    keys = "[position] speed_rad_s; [machine] rated_speed_rad_s"
    yield Entry("omega_most", most, "rad/s", omega_b, f"{keys}; {base}")
    yield Entry("move_speed", speed, "rad/s", TURN_RAD / t_s, f"{keys}; [inverter] pwm_frequency_hz")
    step = _step(speed, acceleration, bits, t_s) if on else 0
    keys = "[position] acceleration_rad_s2, jerk_rad_s3; [machine] inertia_kgm2, rated_current_a, magnet_flux_wb"
    yield Entry("move_step", step, "1", 1.0, keys)
    yield Entry("jerk_bits", bits, "1", 1.0, "[position] jerk_rad_s3, acceleration_rad_s2; [inverter] pwm_frequency_hz")
    keys = "[position] torque_lead_samples; [control] delay_samples, current_bandwidth_hz"
    yield Entry("torque_lead", torque_lead(drive) if on else 0, "1", 1.0, keys)
    stops = on and p.stop_low_rad is not None
    yield Entry("use_stops", int(stops), "1", 1.0, "[position] stop_low_rad, stop_high_rad")
    for name in ("stop_low", "stop_high"):
        turns = getattr(p, f"{name}_rad") / TURN_RAD if stops else 0.0
        yield Entry(name, turns, "turn", 1.0, f"[position] {name}_rad")
    unit, one = ("Nm", drive.torque_base_nm) if drive.core.references else ("A", drive.bases.current_a)
    keys = "[machine] inertia_kgm2, magnet_flux_wb, pole_pairs"
    share = on * fed_forward(drive)
    yield Entry("k_inertia", share * m.inertia_kgm2, f"{unit} s2/rad", one * t_s * t_s / TURN_RAD, keys)
    keys = "[machine] viscous_friction_nms, magnet_flux_wb, pole_pairs"
    yield Entry("k_viscous", share * m.viscous_friction_nms, f"{unit} s/rad of shaft", one * t_s / TURN_RAD, keys)
    keys = "[machine] coulomb_friction_nm, magnet_flux_wb, pole_pairs"
    yield Entry("coulomb", share * m.coulomb_friction_nm, unit, one, keys)
    yield from gear(drive)


def _step(speed, acceleration, bits, t_s):
    """move_step: move_speed is a whole number of it, and it gives the acceleration at most."""
    samples = 1 << (SECTION_BITS + bits)
    of_turns = 2.0**WAY.frac_bits / samples**2  # units of the profile in a turn per sample
    top = math.floor(speed * t_s / TURN_RAD * of_turns)
    steps = max(1, math.ceil(speed / (acceleration * samples * t_s) - 1e-9))
    if top < steps:
        raise DriveError("[position] speed_rad_s is too small for the trajectory at this PWM frequency and jerk")
    return top // steps


def to_position(angle_rad):
    """The position nearest to an angle of the shaft [rad]; ValueError beyond 8192 turns."""
    value = round(angle_rad / TURN_RAD / POSITION.lsb)
    if not POSITION.lo <= value <= POSITION.hi:
        raise ValueError(f"a position of {angle_rad:g} rad is out of range: 8192 turns in both directions are possible")
    return value
