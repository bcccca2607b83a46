# SPDX-License-Identifier: BSD-3-Clause
"""Throttle runs that meet a limit: the voltage of the bus, the current's limit, a trip on the way.

At the limit of the voltage the regulator asks for more than the inverter can give, and the log has what was asked for.
After a trip the voltage references are zero, or keep their last values, while the shaft coasts.
"""

from __future__ import annotations

import functools

import numpy as np

from studies.brought.drives import Made, case, drive_of, true_machine
from studies.brought.motion import Logger, Ride, logged, ride, voltage
from studies.scored.truth import Truth

DRIVES = ("hub_36v", "servo_24v")
OFF = {"healthy": {}, "r130": {"resistance_ohm": 1.3}, "psi90": {"magnet_flux_wb": 0.9}}
WIND_UP = 1.25  # of the voltage that is there: what the regulator asks for
TRIP = 0.6  # of the run
POWER = 0.5  # of that of rated current at the highest EMF
FAST = Ride(load=0.5)
AT_LIMIT, GATES = r"limit|more than the (bus|inverter)|available", r"gates? (are|is|were) off|trip"


def _voltage_limit(name, off, rng) -> Made:
    drive = drive_of(name)
    machine, causes = true_machine(drive, **OFF[off])
    bus = drive["inverter"]["dc_bus_v"] * 0.75  # a battery that is nearly empty
    most = 0.97 * bus / np.sqrt(3.0)
    i, omega, u = ride(machine, FAST, rng, most)
    limited = np.abs(u) > 0.985 * most
    asked = np.where(limited, WIND_UP * u, u)
    columns = logged(i, omega, asked, machine, bus, Logger(), rng)
    return Made(columns, drive, Truth(tuple(causes), readings=AT_LIMIT, limit=AT_LIMIT))


def _current_limit(name, off, rng) -> Made:
    drive = drive_of(name)
    machine, causes = true_machine(drive, **OFF[off])
    way = Ride(low=-0.3, high=1.6)
    i, omega, _ = ride(machine, way, rng)
    i = 1j * np.clip(np.imag(i), -np.inf, machine["rated_current_a"])
    columns = logged(i, omega, voltage(machine, i, omega), machine, drive["inverter"]["dc_bus_v"], Logger(), rng)
    return Made(columns, drive, Truth(tuple(causes), readings=AT_LIMIT))


def _power_limit(name, off, rng) -> Made:
    """A controller that takes no more than a battery may give; it turns its current down as the speed rises."""
    drive = drive_of(name)
    machine, causes = true_machine(drive, **OFF[off])
    i, omega, _ = ride(machine, Ride(low=-0.1, high=1.2, load=1.2), rng)
    emf, r = np.abs(omega * machine["magnet_flux_wb"]), machine["resistance_ohm"]
    most = POWER * machine["rated_current_a"] * float(emf.max())
    i = 1j * np.minimum(np.imag(i), (np.sqrt(emf**2 + 4.0 * r * most) - emf) / (2.0 * r))  # (emf + r i) i = most
    columns = logged(i, omega, voltage(machine, i, omega), machine, drive["inverter"]["dc_bus_v"], Logger(), rng)
    return Made(columns, drive, Truth(tuple(causes), readings=AT_LIMIT))


def _trip(name, off, frozen, rng) -> Made:
    drive = drive_of(name)
    machine, causes = true_machine(drive, **OFF[off])
    way = Ride()
    at = TRIP * way.seconds
    i, omega, u = ride(machine, way, rng, trip_s=at)
    columns = logged(i, omega, u, machine, drive["inverter"]["dc_bus_v"], Logger(), rng)
    off_rows = columns["t"] > at + 0.05
    for key in ("u_d_ref", "u_q_ref"):
        columns[key][off_rows] = columns[key][~off_rows][-1] if frozen else 0.0
    return Made(columns, drive, Truth(tuple(causes), readings=GATES, limit=GATES))


def cases() -> list:
    kinds = {
        "voltage_limit": _voltage_limit,
        "current_limit": _current_limit,
        "power_limit": _power_limit,
        "trip": functools.partial(_trip, frozen=False),
        "trip_frozen": functools.partial(_trip, frozen=True),
    }
    return [
        case(kind, f"{drive}_{off}", functools.partial(lambda m, d, o, rng: m(d, o, rng=rng), make, drive, off))
        for kind, make in kinds.items()
        for drive in DRIVES
        for off in OFF
    ]
