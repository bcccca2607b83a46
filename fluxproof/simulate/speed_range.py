# SPDX-License-Identifier: BSD-3-Clause
"""Torque over speed that the nameplate allows, with the torque table and with i_d = 0, and both circles.

A point (i_d, i_q) is possible at a speed if it is within i_max and its voltage, resistance included, within the circle
of the nominal bus, reserve taken off.  The largest torque of all points is what `references = true` can reach
(golden_model/torque_table.Plane); that of the points with i_d = 0 what the drive has without it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.cosim.scenarios import RPM
from fluxproof.simulate import scene as scenes
from fluxproof.simulate.figures import figure
from golden_model.drive import Drive
from golden_model.torque_table import Plane, linear

POINTS = 49  # speeds of the curves
COARSE = 4  # every how many points of the plane: a curve of the report needs no more
LEAST = 0.02  # of the largest torque: less counts as none


@dataclass(frozen=True)
class SpeedRange:
    """Mechanical speeds (n,) [rad/s], largest torques (n,) [Nm] with the table and without, (n, 2) i_d, i_q of the
    table [A], the axes of the voltage ellipse and whether the drive has the table.
    """

    drive: Drive
    speed: np.ndarray
    with_table: np.ndarray
    without: np.ndarray
    points: np.ndarray
    mtpa: np.ndarray

    def reach(self, torque: np.ndarray) -> float:
        """The largest of the speeds with a torque [rad/s]; 0 without one."""
        some = self.speed[torque > LEAST * self.with_table.max()]
        return float(some[-1]) if len(some) else 0.0

    def base(self) -> float:
        """The largest of the speeds with nearly the whole torque of the table [rad/s]."""
        return float(self.speed[self.with_table > (1.0 - LEAST) * self.with_table.max()][-1])

    def figures(self) -> dict:
        """The figures of the report, all calculated."""
        top = float(self.speed[-1])
        rows = {
            "largest_torque": (self.with_table.max(), "Nm"),
            "largest_torque_at_i_d_zero": (self.without.max(), "Nm"),
            "base_speed": (self.base() / RPM, "rpm"),
            "speed_with_torque_with_references": (self.reach(self.with_table) / RPM, "rpm"),
            "speed_with_torque_at_i_d_zero": (self.reach(self.without) / RPM, "rpm"),
            "torque_at_the_top_speed_with_references": (self.with_table[-1], "Nm"),
            "torque_at_the_top_speed_at_i_d_zero": (self.without[-1], "Nm"),
            "top_speed": (top / RPM, "rpm"),
        }
        return {name: figure(value, unit, "calculated") for name, (value, unit) in rows.items()}

    def ellipse(self, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """(i_d, i_q) of the voltage limit at a mechanical speed, resistance left out [A]."""
        m, turn = self.drive.machine, np.linspace(0.0, 2.0 * np.pi, 181)
        flux = scenes.voltage_limit(self.drive) / (speed * m.pole_pairs)
        i_d = (flux * np.cos(turn) - m.magnet_flux_wb) / m.inductance_d_h
        return i_d, flux * np.sin(turn) / m.inductance_q_h


def speed_range(drive: Drive, top: float) -> SpeedRange:
    """Of a drive up to the mechanical speed ``top`` [rad/s]."""
    m, limit = drive.machine, scenes.voltage_limit(drive)
    plane = Plane(linear(m), m.pole_pairs, drive.current_limit_a)
    i_q, torque = plane.i_q[::COARSE, ::COARSE], plane.torque[::COARSE, ::COARSE]
    i_d = np.broadcast_to(plane.i_d[::COARSE, None], i_q.shape)
    lambda_d, lambda_q = linear(m)(i_d, i_q)
    drop, middle = m.resistance_ohm, int(np.abs(i_d[:, 0]).argmin())
    speeds = np.linspace(0.0, top, POINTS)
    most, without, points = np.zeros(POINTS), np.zeros(POINTS), np.zeros((POINTS, 2))
    for k, speed in enumerate(speeds):
        w = speed * m.pole_pairs
        fits = (drop * i_d - w * lambda_q) ** 2 + (drop * i_q + w * lambda_d) ** 2 <= limit**2
        allowed = np.where(fits, torque, -np.inf)
        best = np.unravel_index(allowed.argmax(), allowed.shape)
        most[k], points[k] = max(float(allowed[best]), 0.0), (i_d[best], i_q[best])
        if most[k] <= 0.0:
            points[k] = np.nan
        without[k] = max(float(allowed[middle].max()), 0.0)
    parts = np.linspace(0.0, 1.0, 12)[1:]
    found = [plane.least_current(part * plane.torque.max(), np.inf) for part in parts]
    mtpa = np.array([(0.0, 0.0), *(point for point in found if point is not None)])
    return SpeedRange(drive, speeds, most, without, points, mtpa)
