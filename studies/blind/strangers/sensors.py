# SPDX-License-Identifier: BSD-3-Clause
"""Converters, encoder and bus measurement, with their faults and resolutions."""

from __future__ import annotations

import numpy as np


class Sensors:
    """What the drive's electronics make of the truth; bits: of the current converters and of the encoder."""

    def __init__(self, drive, truth, rng, current_bits, angle_bits):
        self.drive, self.truth, self.rng = drive, truth, rng
        self.step_a = 2.6 * drive.current / 2**current_bits
        self.step_v = 1.3 * drive.bus / 2**12
        self.step_rad = 2 * np.pi / 2**angle_bits
        self.filtered, self.bus = np.zeros(3), drive.bus
        self.angle, self.speed = None, 0.0

    def _angle(self, theta_m):
        """Electrical angle of the encoder's codes [rad]."""
        t = self.truth
        bent = theta_m + np.real(t.runout * np.exp(1j * theta_m))
        code = np.floor(bent / self.step_rad + 0.5) * self.step_rad
        return (self.drive.pole_pairs * code + t.angle + np.pi) % (2 * np.pi) - np.pi

    def _speed(self, theta_e):
        """Speed of a tracking loop of 60 Hz [rad/s electrical]."""
        h, a = self.drive.period, 2 * np.pi * 60.0
        if self.angle is None:
            self.angle = theta_e
        self.angle += h * self.speed
        error = (theta_e - self.angle + np.pi) % (2 * np.pi) - np.pi
        self.angle += h * 2 * a * error
        self.speed += h * a**2 * error
        return self.speed

    def start(self, omega_e):
        """Let the tracking loop begin at a speed."""
        self.speed = omega_e

    def __call__(self, i_abc, theta_m, bus, share):
        """The measured values of one control period."""
        t, h = self.truth, self.drive.period
        if t.lag:
            self.filtered = i_abc + (self.filtered - i_abc) * np.exp(-h / t.lag)
            i_abc = self.filtered
        i = t.gain * (1.0 + t.gain_drift * share) * i_abc + t.offset + 0.4 * self.step_a * self.rng.standard_normal(3)
        keep = np.exp(-h / t.bus_lag) if t.bus_lag else 0.0
        self.bus = bus + (self.bus - bus) * keep
        u_dc = t.bus_gain * self.bus + 0.4 * self.step_v * self.rng.standard_normal()
        theta_e = self._angle(theta_m)
        return {
            "i_abc": np.round(i / self.step_a) * self.step_a,
            "u_dc": float(np.round(u_dc / self.step_v) * self.step_v),
            "theta_e": float(theta_e),
            "omega_e": float(self._speed(theta_e)),
        }
