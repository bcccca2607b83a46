# SPDX-License-Identifier: BSD-3-Clause
"""Checks across the sections of a drive: settings that are valid alone but contradict each other."""

import math

from golden_model.common.input_filter import FILTER
from golden_model.drive_keys import DriveError, refuse
from golden_model.fluxproof import SAMPLE_INTERVAL
from golden_model.formats import PU, VECTOR
from golden_model.front_ends import check_converters, check_encoder
from golden_model.motion import check_position
from golden_model.protection_checks import check_bootstrap, check_levels, check_regeneration

CARRIER_HALF_RANGE = (8, 32767)  # generic CARRIER_HALF of rtl/fluxproof.vhd
ON_OF_DEAD, ON_S = 0.05, 20e-9  # shortest time that a switch is on: of the dead time, and at least
TURN_SAMPLES = 4.0 * math.pi  # register t_s is a fraction of half a radian at the base of the speed
LEAST_MARGIN_DEG = 30.0  # of the current loop; with less it rings
WHOLE = 1e-6  # relative; a decimal fraction with seven digits counts as exact


def check(drive):
    """Raise DriveError for the first contradiction."""
    for rule in RULES:
        rule(drive)


def _sample_time(drive):
    """The duties are updated at the valley, or at valley and peak."""
    given, period = drive.control.sample_time_s, drive.sample_time_s
    if given is not None and abs(given / period - 1.0) > WHOLE:
        frequency = f"[inverter] pwm_frequency_hz = {drive.inverter.pwm_frequency_hz:g}"
        part = "one PWM period" if drive.core.updates_per_period == 1 else "half a PWM period"
        refuse("[control] sample_time_s", given, f"{period:g} s, {part}, since {frequency}")


def _sampling(drive):
    """A sample belongs to the valley or peak that it is nearest to, and its voltage acts later."""
    delay, half = drive.sampling.delay_s, drive.sample_time_s / 2.0
    if not abs(delay) < half:
        refuse("[sampling] delay_s", delay, f"between -{half:g} and {half:g} s, half a sample time")
    if drive.sampling_to_voltage_s < 0.0:
        most = drive.control.delay_samples * drive.sample_time_s
        refuse("[sampling] delay_s", delay, f"up to {most:g} s, [control] delay_samples")


def _carrier(drive):
    clock, pwm = drive.core.clock_hz, drive.inverter.pwm_frequency_hz
    exact = clock / (2.0 * pwm)
    keys = f"[core] clock_hz = {clock:g} and [inverter] pwm_frequency_hz = {pwm:g}"
    lo, hi = CARRIER_HALF_RANGE
    if exact < lo:
        least = 2.0 * lo * pwm
        raise DriveError(
            f"{keys}: a PWM period has {2.0 * exact:.3g} clocks: allowed is clock_hz above {least:g}, in Hz"
        )
    if not lo <= exact <= hi or abs(exact / round(exact) - 1.0) > WHOLE:
        around = {min(max(half, lo), hi) for half in (math.ceil(min(exact, hi)), math.floor(min(exact, hi)))}
        nearest = " and ".join(f"{clock / (2.0 * half):.7g} Hz" for half in sorted(around, reverse=True))
        raise DriveError(
            f"{keys} make {exact:.9g} clocks in half a PWM period: allowed is a whole number from {lo} to {hi}; "
            f"the nearest PWM frequencies with this clock: {nearest}"
        )
    if drive.core.updates_per_period == 2 and exact < SAMPLE_INTERVAL:
        raise DriveError(
            f"{keys} make {exact:.9g} clocks in half a PWM period: with [core] updates_per_period = 2 each half has a "
            f"sample, which takes {SAMPLE_INTERVAL} clocks"
        )


def _pulses(drive):
    """The dead time comes off every pulse of a leg: what is left for the switch must be long enough to switch it.

    The dead time is the drive's own measure of how slow its switches are: it covers their turn-off and its spread.  A
    switch that is on for less than a twentieth of it is off again before it conducts, and no gate driver passes less
    than 20 ns reliably.  gate_generation besides takes no pulse above half a period.
    """
    i = drive.inverter
    if i.min_on_time_s is None and i.min_pulse_s is None:
        raise DriveError("[inverter] min_on_time_s is missing: the shortest time that a switch is on, or min_pulse_s")
    if i.min_on_time_s is not None and i.min_pulse_s is not None:
        raise DriveError("[inverter] min_on_time_s and min_pulse_s are both given: allowed is one of them")
    dead, pulse, half = i.dead_time_s, i.leg_pulse_s, 0.5 / i.pwm_frequency_hz
    if not dead < half:
        refuse("[inverter] dead_time_s", dead, f"above 0 and below half a PWM period, {half:g} s")
    if not dead < pulse:
        refuse("[inverter] dead_time_s", dead, f"above 0 and below min_pulse_s = {pulse:g} s")
    least = max(ON_OF_DEAD * dead, ON_S)
    if i.on_time_s < least * (1.0 - WHOLE):
        why = f"{least:g} s, a twentieth of dead_time_s and {ON_S:g} s at least: shorter pulses do not turn a switch on"
        if i.min_on_time_s is not None:
            refuse("[inverter] min_on_time_s", i.min_on_time_s, f"at least {why}")
        seen = f"leave the switch {i.on_time_s:.4g} s"
        raise DriveError(
            f"[inverter] min_pulse_s = {pulse:g} and dead_time_s = {dead:g} {seen}: allowed is at least {why}"
        )
    if not pulse <= half:
        key = "min_pulse_s" if i.min_on_time_s is None else "dead_time_s + min_on_time_s"
        refuse(f"[inverter] {key}", pulse, f"up to half a PWM period, {half:g} s")


def _low_side(drive):
    """A shunt in a lower leg shows the current only while its switch is on, and the sample is in the middle of that.

    The largest duty is 1 - reserve/2, so that half of the shortest low time, reserve*T/4, lies before the sample: dead
    time and settling must fit it.  At the peak no lower switch is on.
    """
    settle, period = drive.sensors.low_side_settle_s, 1.0 / drive.inverter.pwm_frequency_hz
    if settle is None:
        return
    if drive.core.updates_per_period == 2:
        refuse("[core] updates_per_period", 2, "1 with [sensors] low_side_settle_s: no lower switch is on at the peak")
    needed_s = settle + drive.inverter.dead_time_s + max(-drive.sampling.delay_s, 0.0)
    least = 4.0 * needed_s / period
    least = max(least, 4.0 * drive.sampling.delay_s / period)  # and the switch is on until then
    if not least < 1.0:
        most = max(0.25 * period - needed_s + settle, 0.0)
        why = f"a quarter of the PWM period, {period:g} s, lies before the sample at most, dead time included"
        refuse("[sensors] low_side_settle_s", settle, f"below {most:.4g} s: {why}")
    if not drive.control.voltage_reserve >= least * (1.0 - WHOLE):
        why = f"half of the low time, voltage_reserve / 4 of {period:g} s, lies before the sample"
        keys = f"[sensors] low_side_settle_s = {settle:g} and dead_time_s = {drive.inverter.dead_time_s:g}"
        refuse("[control] voltage_reserve", drive.control.voltage_reserve, f"at least {least:.4g} for {keys}: {why}")


def _overmodulation(drive):
    """Beyond the circle only with the blocks for it, and where currents are not measured in the lower legs."""
    if drive.fundamental <= 1.0:
        return
    if not drive.core.overmodulation:
        why = "at most 1 without [core] overmodulation"
        refuse("[control] voltage_fundamental", drive.fundamental, why)
    if not drive.core.estimators:
        refuse("[core] estimators", False, "true with overmodulation: the ripple is known from the applied voltage")
    if drive.sensors.low_side_settle_s is not None:
        why = "at most 1 with [sensors] low_side_settle_s: beyond it a leg's lower switch is off for whole periods"
        refuse("[control] voltage_fundamental", drive.fundamental, why)


def _position_pairs(drive):
    """The code of a resolver with several pole pairs repeats within a turn; it must tell the electrical angle."""
    given, pairs, kind = drive.sensors.position_pole_pairs, drive.machine.pole_pairs, drive.encoder.kind
    if given == 1:
        return
    key = "[sensors] position_pole_pairs"
    if pairs % given:
        allowed = [str(n) for n in range(1, pairs + 1) if pairs % n == 0]
        why = f"a divisor of [machine] pole_pairs, {', '.join(allowed)}: else one code is several electrical angles"
        refuse(key, given, why)
    if kind in ("abz", "hall"):
        refuse(key, given, f'1 with [encoder] kind = "{kind}", whose counts are those of a turn of the shaft')
    if drive.core.position_loop:
        refuse(key, given, "1 with [core] position_loop, which counts turns of the code as those of the shaft")


def _samples_per_turn(drive):
    """Flux models and chord integrate over a sample: its angle at the base of the speed is below half a radian."""
    rate, w = 1.0 / drive.sample_time_s, drive.bases.omega_me_rad_s
    samples = 2.0 * math.pi * rate / w
    if samples > TURN_SAMPLES:
        return
    keys = f"[machine] pole_pairs = {drive.machine.pole_pairs}, rated_speed_rad_s = {drive.machine.rated_speed_rad_s:g}"
    if drive.base_choice.omega_me_rad_s is not None:
        keys = f"[bases] omega_me_rad_s = {w:g}"
    pwm = TURN_SAMPLES * w / (2.0 * math.pi) / drive.core.updates_per_period
    enough = drive.core.updates_per_period == 1 and 2.0 * samples > TURN_SAMPLES
    twice = " or [core] updates_per_period = 2" if enough else ""
    keys = f"{keys} with [inverter] pwm_frequency_hz = {drive.inverter.pwm_frequency_hz:g}"
    raise DriveError(
        f"{keys} make {samples:.4g} samples in an electrical turn: allowed is above {TURN_SAMPLES:.4g}, "
        f"that is pwm_frequency_hz above {pwm:.6g} Hz{twice}"
    )


def _voltage(drive):
    """u_max is below one per unit, u_dc / sqrt(3) must fit it."""
    bus, limit = drive.inverter.dc_bus_v, math.sqrt(3.0) * drive.bases.voltage_v
    reach = drive.sensors.u_dc_range_v
    if bus > reach:
        refuse("[inverter] dc_bus_v", bus, f"up to [sensors] u_dc_range_v = {reach:g} V")
    if bus > limit:
        base = "[bases] voltage_v" if drive.base_choice.voltage_v else "[sensors] u_dc_range_v / 2"
        refuse("[inverter] dc_bus_v", bus, f"up to sqrt(3) * {base} = {limit:g} V")


def _current(drive):
    limit, reach = drive.current_limit_a, drive.sensors.current_range_a
    if limit > reach:
        given = drive.control.current_limit_a is not None
        key = "[control] current_limit_a" if given else "[machine] rated_current_a"
        refuse(key, limit, f"up to [sensors] current_range_a = {reach:g} A")
    most = VECTOR * PU.lsb * drive.bases.current_a
    if limit > most:
        refuse("the current limit", limit, f"up to {most:g} A, 1.375 * [bases] current_a: clarke limits beyond")


def _flux(drive):
    """The decoupling clips flux linkages beyond two per unit: L*i at the limit of the current must fit."""
    for axis in "dq":
        key = f"inductance_{axis}_h"
        flux, most = getattr(drive.machine, key) * drive.current_limit_a, 2.0 * drive.bases.flux_wb
        if flux > most:
            why = "twice the flux base, voltage over electrical speed base; see [bases]"
            refuse(f"[machine] {key} times the current limit", flux, f"up to {most:g} Wb, {why}")


def _trip_filter(drive):
    clocks, most = drive.core.trip_filter_clocks, FILTER.hi
    if clocks > most:
        allowed = f"up to {most / drive.core.clock_hz:g} s, {most} clocks of [core] clock_hz = {drive.core.clock_hz:g}"
        refuse("[core] trip_filter_s", drive.core.trip_filter_s, allowed)


def _codes(drive):
    top = 2**drive.sensors.adc_bits - 1
    for code in drive.sensors.current_offset_code or ():
        if not 0 <= code <= top:
            refuse("[sensors] current_offset_code", code, f"0 to {top}")
    if drive.sensors.u_dc_offset_code > top:
        refuse("[sensors] u_dc_offset_code", drive.sensors.u_dc_offset_code, f"0 to {top}")


def _speed_loop(drive):
    """The speed gains divide by the torque constant and are proportional to the inertia."""
    control, machine = drive.control, drive.machine
    if control.speed_bandwidth_hz is None:
        return
    for key in ("inertia_kgm2", "magnet_flux_wb"):
        if getattr(machine, key) <= 0.0:
            refuse(f"[machine] {key}", 0.0, "above 0, since [control] speed_bandwidth_hz is given")


def _current_loop(drive):
    """A delay of d samples shifts the phase of the loop by 90 degrees at 1/(4*d*T_s): unstable from there."""
    control = drive.control
    asked, delay = control.current_bandwidth_hz, drive.sampling_to_voltage_s
    four_delays = 4.0 * delay
    if asked * four_delays >= 1.0:
        reason = f"{delay / drive.sample_time_s:g} samples of delay make the loop unstable from there"
        limit = 1.0 / four_delays
        refuse("[control] current_bandwidth_hz", asked, f"below {limit:g} Hz; {reason}")


def doubts(drive):
    """Sentences on what is allowed and yet hardly wanted: a current loop that rings."""
    asked, delay = drive.control.current_bandwidth_hz, drive.sampling_to_voltage_s
    margin, most = 90.0 - 360.0 * asked * delay, (90.0 - LEAST_MARGIN_DEG) / 360.0 / delay if delay else math.inf
    if asked <= most or drive.control.current_kp_q_v_per_a is not None:
        return []
    return [
        f"[control] current_bandwidth_hz = {asked:g} leaves {margin:.0f} degrees of phase margin at "
        f"{delay / drive.sample_time_s:g} samples of delay: the current rings; at most {most:.4g} Hz leave "
        f"{LEAST_MARGIN_DEG:g} degrees"
    ]


def _flux_loop(drive):
    """Paper 001, end of section 4: below the current loop and above the speed loop, otherwise the loops interact."""
    control = drive.control
    asked, most = control.flux_bandwidth_hz, control.current_bandwidth_hz
    least = control.speed_bandwidth_hz or 0.0
    if asked is not None and not least < asked < most:
        allowed = f"above speed_bandwidth_hz = {least:g} Hz and below current_bandwidth_hz = {most:g} Hz"
        refuse("[control] flux_bandwidth_hz", asked, allowed)


def _adaline_steps(drive):
    """Paper 000 eq. (B.3), 0 < 2*eta*|X|**2 < 1, otherwise the least-mean-square step diverges."""
    control, machine = drive.control, drive.machine
    if control.v_dead_eta >= 0.125:
        why = "eq. (B.3), 2*eta*D**2 < 1 with |D| = 2; the estimate of V_dead would diverge"
        refuse("[control] v_dead_eta", control.v_dead_eta, f"below 0.125: {why}")
    rated = machine.pole_pairs * machine.rated_speed_rad_s
    most = 0.5 / rated / rated
    if control.psi_eta is not None and control.psi_eta >= most:
        why = f"eq. (B.3), 2*eta*omega**2 < 1 at the rated {rated:g} rad/s; the estimate of psi_m would diverge"
        refuse("[control] psi_eta", control.psi_eta, f"below {most:.4g} s2/rad2: {why}")
    if not control.winding_temp_min_c < control.winding_temp_max_c:
        refuse("[control] winding_temp_min_c", control.winding_temp_min_c, "below winding_temp_max_c")


def _residual(drive):
    """The residual takes the voltage of a period from the estimators."""
    if drive.core.residual and not drive.core.estimators:
        raise DriveError("[core] residual = true needs estimators = true")


RULES = (
    _sample_time, _sampling, _carrier, _pulses, _low_side, _overmodulation, _position_pairs, _samples_per_turn,
    _voltage, _current, _flux, _codes, _trip_filter, _speed_loop, _current_loop, _flux_loop, _adaline_steps,
    check_levels, check_bootstrap, check_regeneration, _residual, check_encoder, check_converters, check_position,
)  # fmt: skip
