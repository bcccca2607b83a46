# SPDX-License-Identifier: BSD-3-Clause
"""The interface of a plant, and its integration over the voltages of a control period."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

STEP_S = 25e-6  # longest step of the integration


class Plant(ABC):
    """An inverter, a machine and a shaft.  ``y``: state; ``bus``: the bus voltage [V]; ``t``: time [s]."""

    def __init__(self, drive, truth):
        self.drive, self.truth = drive, truth
        self.bus, self.t, self.share, self.load = drive.bus, 0.0, 0.0, 0.0
        self.y = None

    @abstractmethod
    def rhs(self, t, y, legs):
        """Slope of the state; legs: (3,) leg voltages as a share of the bus."""

    @abstractmethod
    def currents(self):
        """(3,) phase currents at the terminals [A]."""

    @abstractmethod
    def shaft(self):
        """(angle [rad], speed [rad/s], air-gap torque [Nm]) of the mechanical side."""

    def age(self, share: float):
        """Tell the plant which share of the recording has passed, for what warms up."""
        self.share = share

    def advance(self, seconds: float, legs):
        """Fourth-order Runge-Kutta steps over a time with constant leg voltages."""
        count = max(1, int(np.ceil(seconds / STEP_S - 1e-9)))
        h, y = seconds / count, self.y
        for _ in range(count):
            a = self.rhs(self.t, y, legs)
            b = self.rhs(self.t + h / 2, y + h / 2 * a, legs)
            c = self.rhs(self.t + h / 2, y + h / 2 * b, legs)
            d = self.rhs(self.t + h, y + h * c, legs)
            y = y + h / 6 * (a + 2 * b + 2 * c + d)
            self.t += h
        self.y = y

    # -- what both libraries lack ------------------------------------------------------------------------

    def lost(self, i_abc):
        """(3,) voltage lost in inverter legs and unequal phases [V]."""
        t = self.truth
        return t.v_dead * np.tanh(i_abc / t.i_dead) + t.leg + t.r_phase * i_abc

    def drag(self, theta_m, omega_m):
        """Torque of friction and cogging [Nm]."""
        t = self.truth
        pull = t.coulomb * np.tanh(omega_m / 0.5) + t.viscous * omega_m
        return pull + sum(a * np.sin(n * theta_m + phase) for n, (a, phase) in t.cogging.items())
