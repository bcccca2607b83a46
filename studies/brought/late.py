# SPDX-License-Identifier: BSD-3-Clause
"""Slow logs, throttle runs and tables in which an angle or a voltage is late, or iron takes a current: one law each.

angle    i and u turned by exp(j omega tau), the angle being of an earlier instant
filter   u / (1 + j omega tau) of a voltage that was measured through a filter
iron     i with the current j omega psi / R_fe, which does not magnetise
"""

from __future__ import annotations

import functools

import numpy as np

from studies.brought.drives import Made, case, drive_of
from studies.brought.motion import Logger, Ride, logged, ride
from studies.scored.truth import Cause, Truth

DRIVES = ("hub_36v", "servo_24v", "drone_24v")
FORMS = ("throttle", "slow", "table")
CLASS = ("delay", "sampling_skew", "iron_loss")  # u_d with omega^2: load and speed tell them apart
LATE = 0.15  # rad at rated speed, but no more than PERIODS
PERIODS = 20.0
SHARE = 0.1  # of rated current, in the iron at rated speed
SPEEDS = (0.1, 0.4, 0.7, 0.95, -0.5)  # of the rated speed
POINTS = (0.0, -0.4 + 0.5j, 0.9j, -0.6j)  # of the rated current
ROWS, ROW_S = 20, 0.05  # of a point in the slow log
ROOM = 0.05  # of a value: interval of its size
NONE = (0.0, 0.0)  # interval of the form that is not there: a late angle is no late voltage


def _held(machine, rows) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(dq current, electrical speed, dq voltage) of operating points, each in a number of rows."""
    top = machine["pole_pairs"] * machine["rated_speed_rad_s"]
    omega = np.repeat(np.array(SPEEDS) * top, len(POINTS) * rows)
    i = np.tile(np.repeat(np.array(POINTS, complex), rows), len(SPEEDS)) * machine["rated_current_a"]
    return i, omega, machine["resistance_ohm"] * i + 1j * omega * _flux(machine, i)


def _flux(machine, i) -> np.ndarray:
    inductive = machine["inductance_d_h"] * i.real + 1j * machine["inductance_q_h"] * i.imag
    return inductive + machine["magnet_flux_wb"]


def _wrong(kind, machine, tau, i, omega, u):
    """(current, voltage, cause) as recorded."""
    near = lambda x: tuple(sorted(((1 - ROOM) * x, (1 + ROOM) * x)))  # noqa: E731
    others = lambda name: tuple(n for n in CLASS if n != name)  # noqa: E731
    if kind == "angle":
        turn, sizes = np.exp(1j * omega * tau), {"skew_s": near(tau), "angle_late_s": near(tau), "delay_s": NONE}
        return i * turn, u * turn, Cause(("sampling_skew", "delay"), sizes, ("iron_loss",))
    if kind == "filter":
        sizes = {"delay_s": near(-tau), "angle_late_s": NONE}
        return i, u / (1 + 1j * omega * tau), Cause(("delay",), sizes, others("delay"))
    emf = machine["pole_pairs"] * machine["rated_speed_rad_s"] * machine["magnet_flux_wb"]
    ohm = emf / (SHARE * machine["rated_current_a"])
    lost = 1j * omega * _flux(machine, i) / ohm
    sizes = {"iron_resistance_ohm": (0.8 * ohm, 1.2 * ohm)}
    return i + lost, u + machine["resistance_ohm"] * lost, Cause(("iron_loss",), sizes, others("iron_loss"))


def _made(name, form, kind, rng) -> Made:
    drive = drive_of(name)
    machine, inverter = drive["machine"], drive["inverter"]
    late = LATE / (machine["pole_pairs"] * machine["rated_speed_rad_s"])
    late = min(late, PERIODS / inverter["pwm_frequency_hz"])
    state = ride(machine, Ride(), rng) if form == "throttle" else _held(machine, ROWS if form == "slow" else 1)
    i, u, cause = _wrong(kind, machine, late, *state)
    truth, bus = Truth((cause,)), inverter["dc_bus_v"]
    if form == "throttle":
        return Made(logged(i, state[1], u, machine, bus, Logger(), rng), drive, truth)
    noise = lambda scale: 1e-3 * scale * rng.standard_normal(len(i))  # noqa: E731
    rated, top = machine["rated_current_a"], np.abs(state[1]).max()
    columns = {"t": np.arange(len(i)) * ROW_S} if form == "slow" else {}
    columns |= {"i_d": i.real + noise(rated), "i_q": i.imag + noise(rated), "omega_e": state[1] + noise(0.1 * top)}
    columns |= {"u_d_ref": u.real + noise(0.3 * bus), "u_q_ref": u.imag + noise(0.3 * bus), "u_dc": bus + noise(bus)}
    return Made(columns, drive, truth)


def cases() -> list:
    kinds = ("angle", "filter", "iron")
    return [
        case("late", f"{drive}_{form}_{kind}", functools.partial(_made, drive, form, kind))
        for drive in DRIVES
        for form in FORMS
        for kind in kinds
    ]
