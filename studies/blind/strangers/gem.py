# SPDX-License-Identifier: BSD-3-Clause
"""A plant of gym-electric-motor's machine, inverter and load, and a textbook controller for it."""

from __future__ import annotations

import numpy as np
from gym_electric_motor.physical_systems.converters import ContB6BridgeConverter
from gym_electric_motor.physical_systems.electric_motors import PermanentMagnetSynchronousMotor
from gym_electric_motor.physical_systems.mechanical_loads import PolynomialStaticLoad

from studies.blind.strangers.plant import Plant

CLARKE = 2.0 / 3.0 * np.exp(2j * np.pi / 3.0 * np.arange(3))


def phases(vector):
    """(3,) phase values of a space vector."""
    return np.real(vector * np.exp(-2j * np.pi / 3.0 * np.arange(3)))


class GemPlant(Plant):
    """State: speed [rad/s], i_d, i_q [A], electrical angle [rad], as gym-electric-motor orders them."""

    def __init__(self, drive, truth, imposed=None, load=None):
        super().__init__(drive, truth)
        self.imposed = imposed
        self.motor = PermanentMagnetSynchronousMotor(motor_parameter=self._parameters())
        # The library's interlocking time takes v_dead from a leg with the sign of its current.
        self.inverter = ContB6BridgeConverter(
            tau=drive.period, interlocking_time=truth.v_dead / drive.bus * drive.period
        )
        self.friction = PolynomialStaticLoad(load_parameter={"a": truth.coulomb, "b": truth.viscous, "c": 0.0})
        self.inverter.reset()
        start = imposed(0.0) if imposed else 0.0
        self.y = np.array([start, 0.0, 0.0, 0.0])

    def _parameters(self):
        d, t = self.drive, self.truth
        warm = 1.0 - np.exp(-2.5 * self.share)
        return {
            "p": d.pole_pairs, "l_d": t.l_d, "l_q": t.l_q, "j_rotor": d.inertia,
            "r_s": t.r * (1.0 + t.warm_r * warm), "psi_p": t.psi * (1.0 + t.warm_psi * warm),
        }  # fmt: skip

    def age(self, share):
        super().age(share)
        self.motor._motor_parameter.update(self._parameters())
        self.motor._update_model()

    def _terminal(self, y):
        return phases(complex(y[1], y[2]) * np.exp(1j * y[3]))

    def rhs(self, t, y, legs):
        i = self._terminal(y)
        self.inverter.set_action(2.0 * np.asarray(legs) - 1.0, t)
        u = np.array([float(np.squeeze(x)) for x in self.inverter.convert(list(i), t)]) * self.bus
        u = u - self.truth.r_phase * i - self.truth.leg
        u_dq = (CLARKE @ u) * np.exp(-1j * y[3])
        motor = self.motor.electrical_ode(y[1:], [u_dq.real, u_dq.imag], y[0])
        if self.imposed is not None:
            h = 1e-6
            slope = (self.imposed(t + h) - self.imposed(t)) / h
        else:
            slope = (self.motor.torque(y[1:]) - self._load(y[0])) / self.drive.inertia
        return np.concatenate(([slope], motor))

    def _load(self, omega):
        return self.load + float(self.friction._static_load(omega))

    def drag(self, theta_m, omega_m):
        """Friction of the library's polynomial load [Nm]."""
        return float(self.friction._static_load(omega_m))

    def currents(self):
        return self._terminal(self.y)

    def shaft(self):
        p = self.drive.pole_pairs
        return float(self.y[3] / p), float(self.y[0]), float(self.motor.torque(self.y[1:]))


class PiControl:
    """Two PI current regulators with decoupling, a PI speed regulator, duties with the middle voltage removed."""

    def __init__(self, drive, bandwidth, speed_loop, rng):
        self.drive, self.speed_loop, self.bandwidth = drive, speed_loop, bandwidth
        self.integral, self.speed_integral = 0j, 0.0
        self.k_t = 1.5 * drive.pole_pairs * drive.psi

    def _current(self, omega_ref, omega_e):
        d = self.drive
        error = (omega_ref - omega_e) / d.pole_pairs
        a = 2 * np.pi * 4.0
        torque = 2 * a * d.inertia * error + self.speed_integral
        limit = self.k_t * 0.95 * d.current
        if abs(torque) < limit:
            self.speed_integral += a**2 * d.inertia * error * d.period
        return 1j * float(np.clip(torque, -limit, limit)) / self.k_t

    def __call__(self, seen, omega_ref, i_ref):
        """(3,) duties, and the current reference, from the measured values."""
        d, w = self.drive, seen["omega_e"]
        i = (CLARKE @ seen["i_abc"]) * np.exp(-1j * seen["theta_e"])
        if self.speed_loop:
            i_ref = self._current(omega_ref, w)
        error = i_ref - i
        k = self.bandwidth
        u = k * (d.l_d * error.real + 1j * d.l_q * error.imag) + self.integral
        u += complex(-w * d.l_q * i.imag, w * (d.l_d * i.real + d.psi))
        limit = 0.55 * seen["u_dc"]
        if abs(u) < limit:
            self.integral += k * d.period * (d.r + 0.3 * k * d.l_d) * error
        else:
            u *= limit / abs(u)
        legs = phases(u * np.exp(1j * (seen["theta_e"] + 1.5 * w * d.period)))
        legs -= 0.5 * (legs.max() + legs.min())
        return np.clip(0.5 + legs / seen["u_dc"], 0.02, 0.98), i_ref
