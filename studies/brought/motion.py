# SPDX-License-Identifier: BSD-3-Clause
"""A motor that is driven by a throttle, and a logger that writes what it sees: never steady, columns of different age.

The current follows a throttle, the speed the torque, and the voltage is that of the machine:

    u = R i + L di/dt + j omega (L i + psi),   J d omega_m/dt = T - B omega_m - load
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

STEP_S = 1e-3
SETTLE_S = 0.1  # before the log starts
DRY = 0.02  # of rated torque: dry friction


@dataclass(frozen=True)
class Ride:
    """seconds; hold_s, smooth_s: of one throttle position, of the way to the next; low, high: shares of rated current;
    load: torque at rated speed, as a share of the rated one; reach_s: run-up time at rated torque."""

    seconds: float = 60.0
    hold_s: float = 1.5
    smooth_s: float = 0.2
    low: float = -0.4
    high: float = 0.9
    load: float = 1.0
    reach_s: float = 0.3


@dataclass(frozen=True)
class Logger:
    """row_s: between rows; mean: rows are means, else samples; ages_s: how long ago current, speed and voltage are."""

    row_s: float = 0.05
    mean: bool = True
    ages_s: tuple[float, float, float] = (0.0, 0.003, 0.007)


def ride(machine: dict, way: Ride, rng, most_v=np.inf, trip_s=np.inf) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(dq current [A], electrical speed [rad/s], dq voltage [V]), every STEP_S, of a machine.

    most_v: voltage that the inverter can give, which limits the current [V]; trip_s: from here on the gates are off.
    """
    count, pairs = round(way.seconds / STEP_S), machine["pole_pairs"]
    torque = 1.5 * pairs * machine["magnet_flux_wb"]
    knots = rng.uniform(way.low, way.high, int(way.seconds / way.hold_s) + 3) * machine["rated_current_a"]
    t = np.arange(count) * STEP_S
    width = round(way.smooth_s / STEP_S)
    i_q = np.convolve(np.interp(t, np.arange(len(knots)) * way.hold_s, knots), np.ones(width) / width, "same")
    rated, top = torque * machine["rated_current_a"], machine["rated_speed_rad_s"]
    inertia, omega, now = rated * way.reach_s / top, np.zeros(count), 0.0
    i_q[t >= trip_s] = 0.0
    for n in range(1, count):
        i_q[n - 1] = np.clip(i_q[n - 1], *_reach(machine, pairs * now, most_v))
        brake = way.load * rated * now / top + DRY * rated * np.tanh(20.0 * now / top)
        now += STEP_S / inertia * (torque * i_q[n - 1] - brake)
        omega[n] = now
    return 1j * i_q, pairs * omega, voltage(machine, 1j * i_q, pairs * omega)


def _reach(machine, omega, most_v) -> tuple[float, float]:
    """(least, largest) i_q [A] that a voltage drives at a speed, without i_d."""
    r, x, emf = machine["resistance_ohm"], omega * machine["inductance_q_h"], omega * machine["magnet_flux_wb"]
    if most_v == np.inf:
        return -np.inf, np.inf
    z = r**2 + x**2
    root = np.sqrt(max((r * emf) ** 2 - z * (emf**2 - most_v**2), 0.0))
    return (-r * emf - root) / z, (-r * emf + root) / z


def voltage(machine: dict, i, omega) -> np.ndarray:
    """Voltage (n,) [V] of a machine with changing current."""
    flux = machine["inductance_d_h"] * i.real + 1j * machine["inductance_q_h"] * i.imag
    inductive = np.gradient(flux, STEP_S)
    return machine["resistance_ohm"] * i + inductive + 1j * omega * (flux + machine["magnet_flux_wb"])


def logged(i, omega, u, machine: dict, bus_v: float, logger: Logger, rng) -> dict[str, np.ndarray]:
    """The columns of the log, with noise of a thousandth of rated current, bus and highest speed."""
    rows, start = round(logger.row_s / STEP_S), round(SETTLE_S / STEP_S)
    rated = machine["rated_current_a"]
    parts = {
        "i_d": (i.real, 0),
        "i_q": (i.imag, 0),
        "omega_e": (omega, 1),
        "u_d_ref": (u.real, 2),
        "u_q_ref": (u.imag, 2),
    }
    noise = (rated, np.abs(omega).max(), bus_v)
    out = {"t": np.arange(start, len(i), rows) * STEP_S}
    for name, (x, kind) in parts.items():
        if logger.mean:
            x = np.convolve(x, np.ones(rows) / rows)[: len(x)]
        x = np.roll(x, round(logger.ages_s[kind] / STEP_S))[start::rows]
        out[name] = x + 1e-3 * noise[kind] * (0.3 if kind == 2 else 1.0) * rng.standard_normal(len(x))
    out["u_dc"] = bus_v + 1e-3 * bus_v * rng.standard_normal(len(out["t"]))
    return out
