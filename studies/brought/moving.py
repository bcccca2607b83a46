# SPDX-License-Identifier: BSD-3-Clause
"""Logs that are never steady: throttle runs and gaits, of means or of samples, by a drive that is off or is not."""

from __future__ import annotations

import functools

import numpy as np

from studies.brought.drives import Made, case, drive_of, true_machine
from studies.brought.motion import Logger, Ride, logged, ride
from studies.scored.truth import Cause, Truth

DRIVES = ("hub_36v", "servo_24v", "drone_24v")
THROTTLE = Ride()
GAIT = Ride(hold_s=0.25, smooth_s=0.05, low=-0.9, high=0.95, load=0.7)
RIDES = {"throttle": (THROTTLE, (0.02, 0.1)), "gait": (GAIT, (0.02, 0.05))}
LATE = 0.15  # rad at rated speed, where that is no more than two periods of the PWM
OFF = {"healthy": {}, "r130": {"resistance_ohm": 1.3}, "psi90": {"magnet_flux_wb": 0.9}, "late": {}}


def _made(drive_name, way, logger, off, rng) -> Made:
    drive = drive_of(drive_name)
    machine, causes = true_machine(drive, **OFF[off])
    i, omega, u = ride(machine, way, rng)
    if off == "late":
        late = LATE / (machine["pole_pairs"] * machine["rated_speed_rad_s"])
        late = min(late, 2.0 / drive["inverter"]["pwm_frequency_hz"])
        u, causes = u * np.exp(1j * omega * late), [Cause(("delay",), {"delay_s": (0.95 * late, 1.05 * late)},
                                                         ("sampling_skew", "iron_loss"))]  # fmt: skip
    return Made(logged(i, omega, u, machine, drive["inverter"]["dc_bus_v"], logger, rng), drive, Truth(tuple(causes)))


def cases() -> list:
    out = []
    for kind, (way, rows) in RIDES.items():
        for drive in DRIVES:
            for row_s in rows:
                for mean in (True, False):
                    for off in OFF:
                        name = f"{drive}_{round(1e3 * row_s)}ms_{'means' if mean else 'samples'}_{off}"
                        out.append(case(kind, name, functools.partial(_made, drive, way, Logger(row_s, mean), off)))
    return out
