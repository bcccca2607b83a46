# SPDX-License-Identifier: BSD-3-Clause
"""Scenarios for the drive: Fig. 9 of paper 001, and shorter ones that cover the other operating conditions."""

from __future__ import annotations

import math

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from golden_model.drive import Drive
from golden_model.units import from_si

RPM = 2 * math.pi / 60  # mechanical rad/s


def steps(n: int, changes: dict[float, float], per_period: float) -> np.ndarray:
    """A step function over n periods: ``changes`` maps a time [s] to the value from then on; zero before."""
    values = np.zeros(n)
    for time, value in sorted(changes.items()):
        values[round(time / per_period) :] = value
    return values


def scenario(
    drive: Drive, seconds: float, rpm, load=None, u_dc=None, i_d=None, i_q=None, torque_mode=(), off=(), brake=None,
    changes=None, start_rpm=0.0,
) -> Scenario:  # fmt: skip
    """A scenario from step functions in SI units; ``torque_mode`` and ``off`` are (from, to) intervals [s].

    ``changes`` maps a time [s] to the registers (integers by name) that change there.
    """
    t_s = drive.sample_time_s
    n = round(seconds / t_s)
    omega = steps(n, rpm, t_s) * RPM * drive.machine.pole_pairs

    def integers(name: str, values: np.ndarray) -> np.ndarray:
        return np.array([from_si(name, v, drive) for v in values], np.int64)

    def inside(intervals) -> np.ndarray:
        flags = np.zeros(n, np.int64)
        for start, stop in intervals:
            flags[round(start / t_s) : round(stop / t_s)] = 1
        return flags

    return Scenario(
        omega_ref=integers("omega_ref", omega),
        load=steps(n, load or {}, t_s),
        u_dc=steps(n, {0.0: drive.inverter.dc_bus_v} | (u_dc or {}), t_s),
        i_d_ref=integers("i_d_ref", steps(n, i_d or {}, t_s)),
        i_q_ext=integers("i_q_ext", steps(n, i_q or {}, t_s)),
        speed_mode=1 - inside(torque_mode),
        enable=1 - inside(off),
        brake=steps(n, brake or {}, t_s),
        changes={round(time / t_s): registers for time, registers in (changes or {}).items()},
        omega_m=start_rpm * RPM,
    )


def fig9(drive: Drive) -> Scenario:
    """Start, 183 to 732 rpm, then the nominal load of 3.7 Nm, i_d = 0: paper 001, Fig. 9."""
    return scenario(drive, 0.30, rpm={0.0: 183, 0.08: 732}, load={0.18: 3.7})


def everything(drive: Drive) -> Scenario:
    """0.25 s: speed step, load step, bus sag into voltage saturation and back, i_d, torque mode, reversal, stop."""
    return scenario(
        drive,
        0.25,
        rpm={0.0: 183, 0.02: 732, 0.16: -300, 0.235: -500},
        load={0.06: 3.7, 0.15: 0.0},
        u_dc={0.09: 80.0, 0.12: drive.inverter.dc_bus_v},
        i_d={0.13: -2.0, 0.14: 0.0},
        i_q={0.145: -1.5},
        torque_mode=((0.145, 0.155),),
        off=((0.215, 0.225),),
    )


def compressed(drive: Drive) -> Scenario:
    """50 ms with every event of ``everything``, for a simulation that takes its time by the clock."""
    return scenario(
        drive,
        0.05,
        rpm={0.0: 183, 0.006: 732, 0.034: -300, 0.047: -500},
        load={0.012: 3.7, 0.030: 0.0},
        u_dc={0.018: 80.0, 0.024: drive.inverter.dc_bus_v},
        i_d={0.026: -2.0, 0.028: 0.0},
        i_q={0.029: -1.5},
        torque_mode=((0.029, 0.031),),
        off=((0.043, 0.045),),
    )


def tour(drive: Drive) -> Scenario:
    """400 periods in sizes of the drive itself: every event of ``everything`` for any drive file."""
    t, m = 400 * drive.sample_time_s, drive.machine
    rated, current = m.rated_speed_rad_s / RPM, drive.current_limit_a
    torque = 1.5 * m.pole_pairs * m.magnet_flux_wb * current
    return scenario(
        drive,
        t,
        rpm={0.0: 0.3 * rated, 0.2 * t: 0.8 * rated, 0.6 * t: -0.3 * rated},
        load={0.3 * t: 0.4 * torque, 0.5 * t: 0.0},
        u_dc={0.4 * t: 0.4 * drive.inverter.dc_bus_v, 0.5 * t: drive.inverter.dc_bus_v},
        i_d={0.52 * t: -0.2 * current, 0.55 * t: 0.0},
        i_q={0.56 * t: -0.5 * current},
        torque_mode=((0.56 * t, 0.6 * t),),
        off=((0.9 * t, 0.95 * t),),
        start_rpm=0.3 * rated,
    )


def braking(drive: Drive) -> Scenario:
    """300 periods from 0.4 of the rated speed through zero, while the bus rises by a fifth and falls again."""
    t, bus, rated = 300 * drive.sample_time_s, drive.inverter.dc_bus_v, drive.machine.rated_speed_rad_s / RPM
    rises = {(0.1 + 0.02 * k) * t: (1.0 + 0.01 * (k if k <= 20 else 40 - k)) * bus for k in range(41)}
    return scenario(drive, t, rpm={0.0: 0.4 * rated, 0.1 * t: -0.2 * rated}, u_dc=rises, start_rpm=0.4 * rated)


def full_speed(drive: Drive) -> Scenario:
    """On a bus of 300 V towards the rated speed and back through zero: long periods at the voltage limit."""
    return scenario(drive, 0.4, rpm={0.0: 2900, 0.2: -2900}, u_dc={0.0: 300.0})


def short(drive: Drive) -> Scenario:
    """30 ms: start, load, reversal; for a short functional check of a configuration."""
    return scenario(drive, 0.03, rpm={0.0: 400, 0.02: -400}, load={0.01: 2.0})


SCENARIOS = {
    "fig9": fig9,
    "short": short,
    "everything": everything,
    "compressed": compressed,
    "full_speed": full_speed,
    "braking": braking,
    "tour": tour,
}
