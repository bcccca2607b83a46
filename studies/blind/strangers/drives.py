# SPDX-License-Identifier: BSD-3-Clause
"""Machines of published drives: data sheets and the examples of the two simulators; peak values, SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Drive:
    """A drive as its drive file describes it."""

    name: str
    pole_pairs: int
    r: float
    l_d: float
    l_q: float
    psi: float
    current: float
    bus: float
    inertia: float
    period: float

    def toml(self) -> str:
        """The drive file."""
        return (
            f"[machine]\npole_pairs = {self.pole_pairs}\nresistance_ohm = {self.r:.6g}\ntemperature_ref_c = 25.0\n"
            f"inductance_d_h = {self.l_d:.6g}\ninductance_q_h = {self.l_q:.6g}\nmagnet_flux_wb = {self.psi:.6g}\n"
            f"rated_current_a = {self.current:.6g}\ninertia_kgm2 = {self.inertia:.6g}\nviscous_friction_nms = 0.0\n\n"
            f"[inverter]\ndc_bus_v = {self.bus:.6g}\npwm_frequency_hz = {1.0 / self.period:.6g}\n\n"
            f"[control]\nsample_time_s = {self.period:.6g}\nduty_applied_after_samples = 1\n"
        )

    def voltage(self, omega_e: float, i_d: float, i_q: float) -> float:
        """Magnitude of the steady stator voltage [V]."""
        u_d = self.r * i_d - omega_e * self.l_q * i_q
        u_q = self.r * i_q + omega_e * (self.l_d * i_d + self.psi)
        return float(np.hypot(u_d, u_q))


#      name                 p   R       L_d      L_q      psi     A      V      kgm2     s
DRIVES = [
    Drive("2.2 kW servo", 3, 3.6, 36e-3, 51e-3, 0.545, 6.1, 540.0, 0.015, 125e-6),
    Drive("800 V spindle", 4, 0.42, 5.1e-3, 5.4e-3, 0.41, 32.0, 800.0, 0.012, 100e-6),
    Drive("traction 300 V", 3, 18e-3, 0.37e-3, 1.2e-3, 66e-3, 240.0, 300.0, 0.0388, 100e-6),
    Drive("traction 400 V", 4, 9.6e-3, 0.19e-3, 0.48e-3, 85e-3, 330.0, 400.0, 0.06, 125e-6),
    Drive("48 V pump", 4, 0.031, 88e-6, 110e-6, 9.2e-3, 60.0, 48.0, 4e-4, 62.5e-6),
    Drive("24 V joint", 7, 0.21, 120e-6, 130e-6, 4.6e-3, 14.0, 24.0, 5e-5, 50e-6),
    Drive("12 V fan", 5, 0.046, 36e-6, 41e-6, 3.3e-3, 22.0, 12.0, 6e-5, 50e-6),
    Drive("race 400 V", 10, 18e-3, 177e-6, 183e-6, 54e-3, 250.0, 400.0, 0.04, 83.333e-6),
]


def random_drive(rng) -> Drive:
    """One of the drives with parameters up to a quarter off."""
    base = DRIVES[int(rng.integers(len(DRIVES)))]
    near = lambda x: float(f"{x * rng.uniform(0.8, 1.25):.3g}")  # noqa: E731
    return Drive(
        base.name, base.pole_pairs, near(base.r), near(base.l_d), near(base.l_q), near(base.psi),
        base.current, base.bus, near(base.inertia), base.period,
    )  # fmt: skip
