# SPDX-License-Identifier: BSD-3-Clause
"""Random drives from 12 to 800 V, drawn in per-unit of their voltage, current and base speed, and their drive files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#            share of magnet flux, L_d, L_q over L_d
KINDS = {
    "surface": ((0.6, 0.88), (0.10, 0.35), (1.0, 1.08)),
    "interior": ((0.42, 0.72), (0.22, 0.45), (1.35, 2.8)),
    "reluctance": ((0.16, 0.34), (0.16, 0.30), (3.0, 5.5)),
}
#        V      A (low, high)   R per unit       pole pairs     s (control period)
BUSES = [
    (12.0, (8.0, 40.0), (0.05, 0.14), (4, 7), (40e-6, 62.5e-6)),
    (24.0, (5.0, 60.0), (0.04, 0.12), (3, 11), (40e-6, 62.5e-6)),
    (48.0, (15.0, 180.0), (0.02, 0.08), (3, 10), (50e-6, 100e-6)),
    (96.0, (80.0, 420.0), (0.012, 0.04), (3, 8), (62.5e-6, 125e-6)),
    (325.0, (2.0, 35.0), (0.02, 0.09), (2, 5), (62.5e-6, 125e-6)),
    (400.0, (120.0, 500.0), (0.009, 0.03), (3, 6), (80e-6, 125e-6)),
    (560.0, (3.0, 80.0), (0.015, 0.07), (2, 5), (62.5e-6, 200e-6)),
    (800.0, (90.0, 450.0), (0.008, 0.025), (3, 5), (62.5e-6, 100e-6)),
]
RIPPLE = 0.22  # largest current ripple of the modulation over the rated current


def round3(x: float) -> float:
    """Three digits, as on a nameplate."""
    return float(f"{x:.3g}")


@dataclass(frozen=True)
class Drive:
    """A drive as its drive file describes it; SI units, peak values."""

    kind: str
    pole_pairs: int
    r: float
    l_d: float
    l_q: float
    psi: float
    current: float
    bus: float
    inertia: float
    viscous: float
    period: float

    @property
    def base(self) -> float:
        """Largest phase voltage that a plan counts on [V]."""
        return 0.42 * self.bus

    def torque(self, i_d: float, i_q: float) -> float:
        """Torque of the linear machine [Nm]."""
        return 1.5 * self.pole_pairs * (self.psi + (self.l_d - self.l_q) * i_d) * i_q

    def ratio(self) -> float:
        """-i_d over i_q of the most torque at 0.9 of the rated current."""
        angles = np.linspace(0.0, 1.2, 121)
        i = 0.9 * self.current
        best = max(angles, key=lambda a: self.torque(-i * np.sin(a), i * np.cos(a)))
        return float(np.tan(best))

    @property
    def rated_torque(self) -> float:
        """Torque at 0.9 of the rated current [Nm]."""
        i, a = 0.9 * self.current, np.arctan(self.ratio())
        return float(self.torque(-i * np.sin(a), i * np.cos(a)))

    def voltage(self, omega_e: float, i_d: float, i_q: float) -> float:
        """Magnitude of the steady phase voltage [V]."""
        u_d = self.r * i_d - omega_e * self.l_q * i_q
        u_q = self.r * i_q + omega_e * (self.l_d * i_d + self.psi)
        return float(np.hypot(u_d, u_q))

    def toml(self) -> str:
        """The drive file."""
        return (
            f"[machine]\npole_pairs = {self.pole_pairs}\nresistance_ohm = {self.r:.6g}\ntemperature_ref_c = 25.0\n"
            f"inductance_d_h = {self.l_d:.6g}\ninductance_q_h = {self.l_q:.6g}\nmagnet_flux_wb = {self.psi:.6g}\n"
            f"rated_current_a = {self.current:.6g}\ninertia_kgm2 = {self.inertia:.6g}\n"
            f"viscous_friction_nms = {self.viscous:.6g}\n\n"
            f"[inverter]\ndc_bus_v = {self.bus:.6g}\npwm_frequency_hz = {1.0 / self.period:.9g}\n\n"
            f"[control]\nsample_time_s = {self.period:.9g}\nduty_applied_after_samples = 1\n"
        )


def random_drive(rng, kinds=tuple(KINDS)) -> Drive:
    """A drive of one of the kinds."""
    kind = str(rng.choice(kinds))
    magnet, x_d, saliency = KINDS[kind]
    bus, amps, r_pu, poles, periods = BUSES[int(rng.integers(len(BUSES)))]
    bus = round3(bus * rng.uniform(0.85, 1.1))
    current = round3(float(np.exp(rng.uniform(*np.log(amps)))))
    period = float(rng.choice(np.arange(*periods, 2.5e-6)))
    omega = float(np.exp(rng.uniform(np.log(2 * np.pi * 60.0), np.log(2 * np.pi * 0.055 / period))))
    volt = 0.45 * bus
    least = bus * period * omega / (8.0 * RIPPLE * volt)
    x = max(rng.uniform(*x_d), least)
    l_d = round3(x * volt / omega / current)
    l_q = round3(l_d * rng.uniform(*saliency))
    psi = round3(rng.uniform(*magnet) * volt / omega)
    r = round3(float(np.exp(rng.uniform(*np.log(r_pu)))) * volt / current)
    p = int(rng.integers(poles[0], poles[1] + 1))
    rated = Drive(kind, p, r, l_d, l_q, psi, current, bus, 1.0, 0.0, period).rated_torque
    inertia = round3(rated * p / omega * rng.uniform(0.02, 0.09))
    viscous = round3(rated * p / omega * rng.uniform(0.002, 0.01))
    return Drive(kind, p, r, l_d, l_q, psi, current, bus, inertia, viscous, period)
