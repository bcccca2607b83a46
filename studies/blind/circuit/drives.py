# SPDX-License-Identifier: BSD-3-Clause
"""Random machines with their supplies, and their drive files: what the maker measures without load at 25 degC."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from studies.blind.circuit import params
from studies.blind.circuit.iron import linkage


@dataclass(frozen=True)
class Kind:
    """A class of machines: ranges per unit of rated current and of 0.42 of the bus."""

    pole_pairs: tuple[int, ...]
    bus: float  # V
    current: tuple[float, float]  # A
    turns_hz: tuple[float, float]  # electrical frequency at that voltage
    r: tuple[float, float]  # drop at rated current
    x_d: tuple[float, float]
    ratio: tuple[float, float]  # L_q / L_d
    teeth: tuple[int, ...]
    rectifier: bool
    pwm: tuple[float, ...]  # kHz
    inertia: float  # s, time to the speed with rated torque


#                      pole pairs      V    A          Hz          R
KINDS = {
    "hub": Kind(       (7, 10, 20),    48, (15, 40), (130, 260), (0.05, 0.10),
                       (0.18, 0.30), (1.0, 1.08), (6,), False, (16, 20), 0.2),
    "traction": Kind(  (3, 4),        350, (200, 350), (180, 300), (0.015, 0.03),
                       (0.2, 0.3), (1.6, 2.6), (12, 18), False, (8, 10), 0.8),
    "servo": Kind(     (3, 4, 5),     560, (6, 25), (150, 300), (0.03, 0.07),
                       (0.15, 0.28), (1.0, 1.15), (6, 12), True, (8, 10, 16), 0.1),
    "compressor": Kind((2, 3),        310, (8, 20), (130, 240), (0.04, 0.08),
                       (0.18, 0.26), (1.3, 1.8), (6, 12), True, (8, 10), 0.15),
    "rotor": Kind(     (7, 11),        24, (20, 45), (250, 420), (0.06, 0.1),
                       (0.12, 0.2), (1.0, 1.1), (6,), False, (20, 25), 0.1),
}  # fmt: skip


@dataclass(frozen=True)
class Drive:
    """What the drive file says."""

    kind: str
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
        """Amplitude of the steady stator voltage [V]."""
        u_d = self.r * i_d - omega_e * self.l_q * i_q
        u_q = self.r * i_q + omega_e * (self.l_d * i_d + self.psi)
        return float(np.hypot(u_d, u_q))


@dataclass
class Real:
    """The real drive; faults.py changes it."""

    machine: params.Machine
    heat: params.Thermal
    inverter: params.Inverter
    sensors: params.Sensors

    def set(self, part: str, **values):
        """Give values of one part."""
        setattr(self, part, getattr(self, part)._replace(**values))


def random_real(rng, names=tuple(KINDS)) -> tuple[str, Real]:
    """A sound drive: iron far from its knee, fast switches, a supply of a few per cent."""
    name = str(rng.choice(names))
    kind = KINDS[name]
    current, pole_pairs = float(rng.uniform(*kind.current)), int(rng.choice(kind.pole_pairs))
    period = 1e-3 / float(rng.choice(kind.pwm))
    volt = 0.42 * kind.bus
    omega = 2 * np.pi * rng.uniform(*kind.turns_hz)
    x_d, ratio = rng.uniform(*kind.x_d), rng.uniform(*kind.ratio)
    x_q = x_d * ratio
    e = np.sqrt(max(0.3, 0.85 - x_q**2))
    psi = e * volt / omega
    l_d, l_q = x_d * volt / current / omega, x_q * volt / current / omega
    most = np.hypot(psi, l_q * current)  # flux linkage at rated current
    torque = 1.5 * pole_pairs * psi * current
    inertia = kind.inertia * torque * pole_pairs / omega
    machine = params.Machine(
        pole_pairs, rng.uniform(*kind.r) * volt / current, psi, 1 / l_d, 1 / l_q, current, inertia,
        int(rng.choice(kind.teeth)),
        tooth_t=rng.uniform(0.95, 1.1) / most, yoke_t=rng.uniform(0.85, 1.05) / most,
        bridge_d_t=rng.uniform(0.7, 0.9) / most, bridge_q_t=rng.uniform(0.7, 0.9) / (l_q * current + 0.4 * psi),
        iron_m=current / rng.uniform(9e3, 14e3),
        slot=rng.uniform(0.0, 0.001), emf_6=rng.uniform(0.0, 0.0008), emf_12=rng.uniform(0.0, 0.0004),
        emf_q=rng.uniform(-1.0, 1.0), emf_phase=rng.uniform(0.0, 6.28), cogging=rng.uniform(0.0, 0.0006) * torque,
        friction=rng.uniform(0.0, 0.0015) * torque,
        g_eddy=rng.uniform(0.0, 0.0008) * current / volt, g_hysteresis=rng.uniform(0.0, 0.0008) * current / most,
    )  # fmt: skip
    heavy = 1.5 * machine.r * current**2
    heat = params.Thermal(
        c_winding=6.0 * heavy, c_iron=60.0 * heavy, c_magnet=20.0 * heavy,
        k_winding=heavy / 60.0, k_magnet=heavy / 200.0, k_ambient=heavy / 60.0, magnet_share=0.1,
    )  # fmt: skip
    stiff = 333.0 if kind.rectifier else 83.0  # a quarter of a per cent of ripple at the PWM frequency, or less
    inverter = params.Inverter(
        period, float(kind.bus), current,
        dead=0.0004 * period, t_on=0.0002 * period, t_off=0.0003 * period, c_leg=1e-5 * period * current / kind.bus,
        v_switch=rng.uniform(2e-4, 5e-4) * kind.bus, v_diode=rng.uniform(2e-4, 5e-4) * kind.bus,
        r_on=0.004 * machine.r, c_bus=rng.uniform(0.8, 1.5) * stiff * current * period / kind.bus,
        r_bus=rng.uniform(0.015, 0.04) * kind.bus / current, rectifier=kind.rectifier,
        mains_hz=float(rng.choice((50.0, 60.0))),
    )  # fmt: skip
    sensors = params.Sensors(
        range_a=1.6 * current, bits=int(rng.integers(12, 17)), range_v=1.4 * kind.bus,
        encoder_bits=int(rng.integers(13, 18)), noise_a=rng.uniform(0.5, 2.0) * 1e-3 * current,
        noise_v=rng.uniform(0.2, 0.6) * 1e-3 * kind.bus,
        bus_every=1 if kind.rectifier else int(rng.integers(1, 5)), speed_every=int(rng.integers(8, 21)),
        runout=rng.uniform(0.0, 0.001) / pole_pairs, runout_phase=rng.uniform(0.0, 6.28),
        resolver=rng.uniform(0.0, 0.0005) / pole_pairs, hum=rng.uniform(0.0, 5e-4) * current,
    )  # fmt: skip
    for k in "abc":
        machine = machine._replace(**{f"r_{k}": rng.uniform(-0.002, 0.002)})
        sensors = sensors._replace(**{f"gain_{k}": 1.0 + rng.uniform(-3e-4, 3e-4)})
        sensors = sensors._replace(**{f"offset_{k}": rng.uniform(-3e-4, 3e-4) * current})
    return name, Real(machine, heat, inverter, sensors)


def sheet(kind: str, real: Real) -> Drive:
    """The drive file of a machine: what its maker measures with small currents at 25 degC."""
    m, v = real.machine, real.inverter
    small = 0.05 * m.rated
    psi = linkage(m, m.psi, 0.0, 0.0)[0]
    l_d = (linkage(m, m.psi, small, 0.0)[0] - linkage(m, m.psi, -small, 0.0)[0]) / (2 * small)
    l_q = (linkage(m, m.psi, 0.0, small)[1] - linkage(m, m.psi, 0.0, -small)[1]) / (2 * small)
    r = m.r * (1.0 + (m.r_a + m.r_b + m.r_c) / 3.0) + v.r_on
    return Drive(kind, m.pole_pairs, r, l_d, l_q, psi, m.rated, v.bus, m.inertia, v.period)


def wrong(drive: Drive, **values) -> Drive:
    """The drive file with values that are not true."""
    return replace(drive, **values)
