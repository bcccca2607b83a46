# SPDX-License-Identifier: BSD-3-Clause
"""Stability of drive and estimator together: eigenvalues of one sample over the whole range of speed.

For equal inductances every signal is a complex number in the rotor frame (d + j*q), and the drive at a constant speed
is linear in eight of them: flux, voltage in force, integral of the current regulators and its value before, merged
flux, x, the compensation and its integral.  ``sample_matrix`` writes one sample of docs/flux_estimator.md as a matrix.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from golden_model.scaling import current_gains, flux_estimator
from studies.papers.flux_bench import DRIVE, Experiment, Finding

FLUX, VOLTAGE, INTEGRAL, INTEGRAL_1, MERGED, X, COMPENSATION, LEARNT = range(8)


class Gains:
    """What the registers of a drive hold, in SI units, and the factors by which the estimator is wrong."""

    def __init__(self, drive=DRIVE, inductance_factor: float = 1.0, resistance_factor: float = 1.0, **changes: float):
        m, entries = drive.machine, {e.name: e.si for e in flux_estimator(drive)} | changes
        self.t_s, self.resistance = drive.sample_time_s, m.resistance_ohm
        self.inductance = (m.inductance_d_h + m.inductance_q_h) / 2
        gains = np.mean([current_gains(drive, axis) for axis in "dq"], axis=0)
        self.kp, self.ki = gains[0], gains[1] * self.t_s
        self.model_inductance = inductance_factor * self.inductance
        self.model_resistance = resistance_factor * self.resistance
        self.w, self.xi = entries["omega_0"] * self.t_s, entries["xi"]
        self.flux_kp, self.flux_ki = entries["flux_kp"], entries["flux_ki"] * self.t_s
        self.omega_min, self.k_ramp = entries["omega_min"], entries["k_ramp"]

    def weight(self, omega: float) -> float:
        """How much of the compensation is used at a speed [electrical rad/s]."""
        return min(max((abs(omega) - self.omega_min) * self.k_ramp, 0.0), 1.0)


def sample_matrix(omega: float, g: Gains) -> np.ndarray:
    """One sample at a constant electrical speed [rad/s]: complex (8, 8), deviations from the steady state."""
    turn, decay = cmath.exp(-1j * omega * g.t_s), math.exp(-g.resistance / g.inductance * g.t_s)
    chord = omega * (1.0 - (omega * g.t_s) ** 2 / 24.0)
    rho = g.model_resistance * g.t_s / 2.0
    matrix = np.zeros((8, 8), complex)
    for n in range(8):
        s = np.zeros(8, complex)
        s[n] = 1.0
        current = s[FLUX] / g.inductance
        integral = s[INTEGRAL] - g.ki * current
        now = s[MERGED] - rho * current
        delta = 0.0
        if g.weight(omega) > 0.0:
            delta = g.weight(omega) * (s[INTEGRAL_1] - g.model_resistance * current) / (1j * omega)
        learnt = s[LEARNT] + g.flux_ki * delta
        voltage = -g.kp * current + integral + 1j * chord * (now + s[COMPENSATION])
        applied = s[VOLTAGE]
        y = g.w * (g.model_inductance * current - now)
        x = s[X] + g.w * y
        following = np.zeros(8, complex)
        driven = (1.0 - decay) * g.inductance / g.resistance * applied
        following[FLUX] = turn * (decay * s[FLUX] + driven)
        following[VOLTAGE] = voltage * cmath.exp(0.5j * omega * g.t_s)
        following[INTEGRAL] = integral
        following[INTEGRAL_1] = s[INTEGRAL]
        following[MERGED] = turn * (now + 2.0 * g.xi * y + x + g.t_s * applied - rho * current)
        following[X] = turn * x
        following[COMPENSATION], following[LEARNT] = g.flux_kp * delta + learnt, learnt
        matrix[:, n] = following
    return matrix


def radius(omega: float, g: Gains) -> float:
    """Largest modulus of the eigenvalues at a speed: below one is stable.

    Without compensation its integral stays where it is, by design: that one eigenvalue is left out there.
    """
    values = np.sort(np.abs(np.linalg.eigvals(sample_matrix(omega, g))))
    return values[-1] if g.weight(omega) > 0.0 else values[-2]


def merge_radius(w: float, xi: float) -> float:
    """Largest modulus of the merge's own poles: (z - 1)**2 + (2*xi*w + w**2)*(z - 1) + w**2 = 0."""
    return max(abs(np.roots([1.0, 2 * xi * w + w * w - 2.0, 1.0 - 2 * xi * w])))


def stability() -> Experiment:
    """The merge over every legal gain; drive and estimator over the range of speed with wrong parameters."""
    legal_w = np.geomspace(2.0**-10, 0.25, 60)
    merge = max(merge_radius(w, xi) for w in legal_w for xi in np.linspace(0.25, 2.0, 60))
    speeds = np.concatenate([-(s := np.geomspace(1.0, 2 * DRIVE.bases.omega_me_rad_s, 120)), s])
    found = [Finding("Merge: largest pole over every legal omega_0 and xi", None, float(merge), "modulus", merge < 1)]
    curves = {}
    for inductance in (0.7, 1.0, 1.3):
        for resistance in (0.6, 1.0, 1.4):
            g = Gains(inductance_factor=inductance, resistance_factor=resistance)
            curves[inductance, resistance] = np.array([radius(w, g) for w in speeds])
    worst = max(curve.max() for curve in curves.values())
    label = "Drive and estimator: largest eigenvalue up to twice the rated speed, L x 0.7 to 1.3, R x 0.6 to 1.4"
    found.append(Finding(label, "stable", float(worst), "modulus", worst < 1))
    slowest = -DRIVE.sample_time_s * 1e3 / math.log(curves[1.0, 1.0][np.abs(speeds) > 80].max())
    found.append(
        Finding(
            "Drive and estimator: slowest time constant above 80 rad/s, right parameters",
            None,
            slowest,
            "ms",
            True,
        )
    )
    limits = {}
    for omega in (100.0, 500.0, 1256.0):
        gains = np.geomspace(1, 50, 200)
        own = Gains()
        kp, ki = own.flux_kp, own.flux_ki
        stable = 1.0
        for factor in gains:
            own.flux_kp, own.flux_ki = kp * factor, ki * factor
            if radius(omega, own) >= 1.0:
                break
            stable = factor
        limits[omega] = stable
    margin = min(limits.values())
    found.append(
        Finding(
            "Compensation: its gains may grow before instability, worst of 100, 500, 1256 rad/s",
            None,
            float(margin),
            "times",
            margin > 2,
        )
    )
    return Experiment("Stability", found, {"speeds": speeds, "curves": curves})
