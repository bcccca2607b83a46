# SPDX-License-Identifier: BSD-3-Clause
"""Encoder eccentricity: an angle error that repeats with the mechanical turn."""

import numpy as np

from fluxproof.diagnosis.effects import FreeCurve, MeasurementError, Orders, Parameter, Wave, angle_error
from fluxproof.diagnosis.ground.result import Estimate

COS, SIN = Wave(1, "cos"), Wave(1, "sin")
TWICE = Wave(2, "cos"), Wave(2, "sin")


def _more(view):
    """Further orders per turn of the error; one that equals the electrical order would resemble a current offset."""
    return sorted({2, 3, view.machine.pole_pairs} - {1})


def _turns(view, orders):
    theta_m = view.theta / view.machine.pole_pairs
    return {Wave(n, f.__name__): f(n * theta_m) for n in orders for f in (np.cos, np.sin)}


def _acceleration(view, order, wave):
    """Apparent d omega_m / dt due to a harmonic of the angle error, (b, m) [rad/s^2]."""
    middle = 0.5 * (wave[:, 1:] + wave[:, :-1])
    return -((order * view.omega_mid / view.machine.pole_pairs) ** 2) * middle / view.machine.pole_pairs


def _column(view, order, wave):
    column = angle_error(view, wave)
    column["torque"] = column["torque"] + (view.machine.inertia_kgm2 or 0.0) * _acceleration(view, order, wave)
    return column


class EncoderEccentricity(MeasurementError, FreeCurve):
    def core(self, view):
        return {name: _column(view, name.order, wave) for name, wave in _turns(view, (1,)).items()}

    def free(self, view):
        return {name: _column(view, name.order, wave) for name, wave in _turns(view, _more(view)).items()}

    def floor(self, nominal):
        return 0.003

    def ceiling(self, nominal):
        return 0.5

    def size(self, c, nominal):
        return float(np.sqrt(sum(v**2 for v in c.values())))

    def corrected(self, view, c):
        waves = _turns(view, (1, *_more(view)))
        false = sum(value * _acceleration(view, name.order, waves[name]) for name, value in c.items())
        return view.turned(sum(value * waves[name] for name, value in c.items())).replace(slope_m=view.slope_m - false)

    def estimates(self, c, covariance, nominal):
        first = np.hypot(c[COS], c[SIN])
        spread = float(np.sqrt(0.5 * np.trace(covariance[:2, :2])))
        return {"amplitude_rad": Estimate(float(first), spread, "rad")}

    def plant(self, c, nominal):
        p = nominal.machine.pole_pairs
        out = {
            "sensors.eccentricity_once_rad": float(np.hypot(c[COS], c[SIN])) / p,
            "sensors.eccentricity_once_phase_rad": float(np.arctan2(c[COS], c[SIN])),
        }
        if TWICE[0] in c:
            cos, sin = (c[wave] for wave in TWICE)
            out["sensors.eccentricity_twice_rad"] = float(np.hypot(cos, sin)) / p
            out["sensors.eccentricity_twice_phase_rad"] = float(np.arctan2(cos, sin))
        return out


EFFECT = EncoderEccentricity(
    name="encoder_eccentricity",
    title="encoder eccentricity",
    equation="theta_measured = theta_e + a cos(theta_m) + b sin(theta_m) (+ orders 2, 3 and p per turn)",
    signature="order 1/p in dq: omega psi_m a on the d axis",
    separated_by="the mechanical index: orders per mechanical turn; more than one pole pair",
    parameters=(Parameter("amplitude_rad", "rad", "electrical, once per mechanical turn", "amplitude"),),
    needs=("harmonics", "angle"),
    shows_at=Orders((), per_turn=(1.0, 2.0, 3.0)),
)
