# SPDX-License-Identifier: BSD-3-Clause
"""Checks of [protection] beside the other sections: settings that blind a protection, or that hurt by themselves."""

import math

from golden_model.drive_keys import DriveError, refuse
from golden_model.protection_limits import BRAKE_HYSTERESIS, default_u_dc_max_v, regen_end_v

HURTS = 1.5  # times the current limit
LEAST_WATCHDOG = 3.0  # sample times that are always allowed without a sample


def check_levels(drive):
    """A trip level must lie outside the operating range of the drive and inside the range of its sensors."""
    p, limit, reach = drive.protection, drive.current_limit_a, drive.sensors.current_range_a
    if p.current_trip_a is not None and not limit < p.current_trip_a <= reach:
        allowed = f"above the current limit, {limit:g} A, up to [sensors] current_range_a = {reach:g} A"
        refuse("[protection] current_trip_a", p.current_trip_a, allowed)
    bus, reach = drive.inverter.dc_bus_v, drive.sensors.u_dc_range_v
    if p.u_dc_min_v is not None and not p.u_dc_min_v < bus:
        refuse("[protection] u_dc_min_v", p.u_dc_min_v, f"below [inverter] dc_bus_v = {bus:g} V")
    if p.u_dc_max_v is not None and not bus < p.u_dc_max_v <= reach:
        allowed = f"above [inverter] dc_bus_v = {bus:g} V, up to [sensors] u_dc_range_v = {reach:g} V"
        refuse("[protection] u_dc_max_v", p.u_dc_max_v, allowed)
    most = p.u_dc_max_v or default_u_dc_max_v(drive)
    if p.brake_on_v is not None and not bus < p.brake_on_v < most:
        allowed = f"above [inverter] dc_bus_v = {bus:g} V and below u_dc_max_v = {most:g} V, which trips"
        refuse("[protection] brake_on_v", p.brake_on_v, allowed)
    _brake_off(p, bus)
    if p.overspeed_rad_s is not None and not p.overspeed_rad_s > drive.machine.rated_speed_rad_s:
        refuse("[protection] overspeed_rad_s", p.overspeed_rad_s, "above [machine] rated_speed_rad_s")
    if p.trip_watchdog and not 1.0 < p.watchdog_periods <= (most := _watchdog_most(drive)):
        allowed = (
            f"above 1 up to {most:.3g}, while the current rises by half its limit; trip_watchdog = false ignores it"
        )
        refuse("[protection] watchdog_periods", p.watchdog_periods, allowed)
    if not p.watchdog_periods > 1.0:
        refuse("[protection] watchdog_periods", p.watchdog_periods, "above 1")
    m = drive.machine
    emf = m.pole_pairs * m.rated_speed_rad_s * m.magnet_flux_wb
    if p.encoder_lost_v is not None and emf > 0.0 and not p.encoder_lost_v < emf:
        refuse("[protection] encoder_lost_v", p.encoder_lost_v, f"below {emf:.4g} V, the EMF at rated speed")


def _brake_off(p, bus):
    """The supply alone must not keep the brake resistor on."""
    if p.brake_on_v is None:
        if p.brake_off_v is not None:
            raise DriveError("[protection] brake_off_v needs brake_on_v, from which the brake resistor is on")
        return
    if p.brake_off_v is None and not BRAKE_HYSTERESIS * p.brake_on_v > bus:
        allowed = f"above {bus / BRAKE_HYSTERESIS:.4g} V, so that {BRAKE_HYSTERESIS:g} of it, where the resistor is off"
        refuse("[protection] brake_on_v", p.brake_on_v, f"{allowed} again, is above [inverter] dc_bus_v = {bus:g} V")
    if p.brake_off_v is not None and not bus < p.brake_off_v < p.brake_on_v:
        allowed = f"above [inverter] dc_bus_v = {bus:g} V, which keeps the resistor on, and below brake_on_v"
        refuse("[protection] brake_off_v", p.brake_off_v, f"{allowed} = {p.brake_on_v:g} V")


def _watchdog_most(drive):
    """Sample times without a sample in which the current rises by half its limit at rated speed.

    The duties stand while the EMF turns on: L di/dt = psi omega (omega t), so i = psi omega**2 t**2 / (2 L).
    """
    m = drive.machine
    omega, psi = m.pole_pairs * m.rated_speed_rad_s, m.magnet_flux_wb
    if psi <= 0.0:
        return math.inf
    inductance, rise = min(m.inductance_d_h, m.inductance_q_h), (HURTS - 1.0) * drive.current_limit_a
    return max(LEAST_WATCHDOG, math.sqrt(2.0 * inductance * rise / psi) / omega / drive.sample_time_s)


def check_bootstrap(drive):
    """The lower switches short the motor while the bootstraps charge: a rotor that turns drives a current."""
    m, given = drive.machine, drive.inverter.bootstrap_charge_s
    omega = m.pole_pairs * m.rated_speed_rad_s
    emf, inductance = omega * m.magnet_flux_wb, min(m.inductance_d_h, m.inductance_q_h)
    steady = emf / math.hypot(m.resistance_ohm, omega * inductance)
    limit = HURTS * drive.current_limit_a
    if given <= 0.0 or steady <= limit:
        return
    most = limit * inductance / emf
    if given > most:
        allowed = f"up to {most:.3g} s: the lower switches short the motor, whose EMF at rated speed drives the current"
        refuse("[inverter] bootstrap_charge_s", given, f"{allowed} to {limit:g} A, {HURTS:g} times its limit")


def check_regeneration(drive):
    """As the bus rises: the chopper first, then the line that limits the braking current, the trip last."""
    p, bus = drive.protection, drive.inverter.dc_bus_v
    if p.regen_start_v is None:
        if p.regen_end_v is not None:
            raise DriveError(
                "[protection] regen_end_v needs regen_start_v, where the limit of the braking current begins"
            )
        return
    key, least = ("brake_on_v", p.brake_on_v) if p.brake_on_v is not None else ("[inverter] dc_bus_v", bus)
    most = p.u_dc_max_v or default_u_dc_max_v(drive)
    if not least < p.regen_start_v < most:
        allowed = f"above {key} = {least:g} V and below u_dc_max_v = {most:g} V, which trips"
        refuse("[protection] regen_start_v", p.regen_start_v, allowed)
    if not p.regen_start_v < regen_end_v(drive) < most:
        allowed = f"above regen_start_v = {p.regen_start_v:g} V and below u_dc_max_v = {most:g} V, which trips"
        refuse("[protection] regen_end_v", p.regen_end_v, allowed)
