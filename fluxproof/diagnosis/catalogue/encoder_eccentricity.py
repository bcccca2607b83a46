# SPDX-License-Identifier: BSD-3-Clause
"""Encoder eccentricity: an angle error that repeats with the mechanical turn."""

import numpy as np

from fluxproof.diagnosis.effects.effect import Effect, Parameter, angle_error
from fluxproof.diagnosis.ground.result import Estimate


def _more(view):
    """Further orders per turn of the error; one that equals the electrical order would resemble a current offset."""
    return sorted({2, 3, view.machine.pole_pairs} - {1})


def _turns(view, orders):
    theta_m = view.theta / view.machine.pole_pairs
    return {f"{f.__name__}_{n}": f(n * theta_m) for n in orders for f in (np.cos, np.sin)}


def _acceleration(view, name, wave):
    """Apparent d omega_m / dt due to a harmonic of the angle error, (b, m) [rad/s^2]."""
    middle = 0.5 * (wave[:, 1:] + wave[:, :-1])
    return (
        -((int(name.split("_")[1]) * view.omega_mid / view.machine.pole_pairs) ** 2) * middle / view.machine.pole_pairs
    )


def _column(view, name, wave):
    column = angle_error(view, wave)
    column["torque"] = column["torque"] + (view.machine.inertia_kgm2 or 0.0) * _acceleration(view, name, wave)
    return column


class EncoderEccentricity(Effect):
    def core(self, view):
        return {name: _column(view, name, wave) for name, wave in _turns(view, (1,)).items()}

    def free(self, view):
        return {name: _column(view, name, wave) for name, wave in _turns(view, _more(view)).items()}

    def floor(self, nominal):
        return 0.003

    def ceiling(self, nominal):
        return 0.5

    def size(self, c, nominal):
        return float(np.sqrt(sum(v**2 for v in c.values())))

    def corrected(self, view, c):
        waves = _turns(view, (1, *_more(view)))
        false = sum(value * _acceleration(view, name, waves[name]) for name, value in c.items())
        return view.turned(sum(value * waves[name] for name, value in c.items())).replace(slope_m=view.slope_m - false)

    def estimates(self, c, covariance, nominal):
        first = np.hypot(c["cos_1"], c["sin_1"])
        spread = float(np.sqrt(0.5 * np.trace(covariance[:2, :2])))
        return {"amplitude_rad": Estimate(float(first), spread, "rad")}

    def plant(self, c, nominal):
        p = nominal.machine.pole_pairs
        out = {
            "sensors.eccentricity_once_rad": float(np.hypot(c["cos_1"], c["sin_1"])) / p,
            "sensors.eccentricity_once_phase_rad": float(np.arctan2(c["cos_1"], c["sin_1"])),
        }
        if "cos_2" in c:
            out["sensors.eccentricity_twice_rad"] = float(np.hypot(c["cos_2"], c["sin_2"])) / p
            out["sensors.eccentricity_twice_phase_rad"] = float(np.arctan2(c["cos_2"], c["sin_2"]))
        return out


EFFECT = EncoderEccentricity(
    name="encoder_eccentricity",
    title="encoder eccentricity",
    equation="theta_measured = theta_e + a cos(theta_m) + b sin(theta_m) (+ orders 2, 3 and p per turn)",
    signature="order 1/p in dq: omega psi_m a on the d axis",
    confounders=("current_offset",),
    separated_by="the mechanical index: orders per mechanical turn; more than one pole pair",
    parameters=(Parameter("amplitude_rad", "rad", "electrical, once per mechanical turn", "amplitude"),),
    corrects=True,
    stays="an error of measurement is in the recording itself; the trims act from the next one on",
    shows_at=(),
    shows_at_turns=(1.0, 2.0, 3.0),
    needs=("harmonics", "angle"),
)
