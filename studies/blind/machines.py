# SPDX-License-Identifier: BSD-3-Clause
"""Random drives with realistic per-unit values, and the nominal drive.toml of each."""

from __future__ import annotations

import math
from dataclasses import dataclass

from studies.blind import params as P


@dataclass
class Nominal:
    """A drive as its maker describes it.

    machine, inverter, control: the sections of drive.toml.  omega_rated: electrical [rad/s].
    """

    machine: dict
    inverter: dict
    control: dict
    omega_rated: float
    torque_rated: float
    svm: bool

    @property
    def period_s(self):
        return self.control["sample_time_s"]

    @property
    def voltage_limit(self):
        """Largest voltage vector [V] of the linear modulation range."""
        return self.inverter["dc_bus_v"] * (1.0 / math.sqrt(3.0) if self.svm else 0.5)

    def voltage(self, omega, i_d, i_q):
        """Magnitude of the steady-state voltage [V] at electrical speed [rad/s] and currents [A]."""
        m = self.machine
        u_d = m["resistance_ohm"] * i_d - omega * m["inductance_q_h"] * i_q
        u_q = m["resistance_ohm"] * i_q + omega * (m["inductance_d_h"] * i_d + m["magnet_flux_wb"])
        return math.hypot(u_d, u_q)

    def toml(self) -> str:
        """The text of drive.toml."""
        lines = []
        for name in ("machine", "inverter", "control"):
            lines.append(f"[{name}]")
            lines += [f"{key} = {value!r}" for key, value in getattr(self, name).items()]
        return "\n".join(lines) + "\n"


def _digits(x, n=5):
    return float(f"{x:.{n}g}")


def _bus(rng, power):
    ranges = ((500.0, (24, 36, 48, 60)), (3e3, (48, 96, 160, 325)), (2e4, (325, 400, 540, 565)))
    for most, buses in ranges:
        if power < most:
            return float(rng.choice(buses))
    return float(rng.choice((400, 565, 650, 800)))


def random_nominal(rng) -> Nominal:
    """One drive of 50 W to 200 kW whose current ripple is below a quarter of the rated current."""
    while True:
        power = 10.0 ** rng.uniform(math.log10(50.0), math.log10(2e5))
        bus, f_pwm = _bus(rng, power), float(rng.choice((8e3, 10e3, 10e3, 12.5e3, 16e3, 20e3)))
        omega = 2.0 * math.pi * min(10.0 ** rng.uniform(math.log10(60.0), math.log10(400.0)), f_pwm / 30.0)
        linear = bus / math.sqrt(3.0)
        psi = rng.uniform(0.45, 0.7) * linear / omega
        i_rated = power / (1.5 * omega * psi)
        l_q = rng.uniform(0.2, 0.55) * psi / i_rated
        saliency = rng.choice((1.0, rng.uniform(0.9, 1.06), rng.uniform(1.15, 3.0)), p=(0.25, 0.25, 0.5))
        l_d = l_q / saliency
        if bus / (8.0 * min(l_d, l_q) * f_pwm) < 0.25 * i_rated:
            break
    r = min(max(0.13 * (power / 50.0) ** -0.3, 0.01), 0.13) * rng.uniform(0.7, 1.4) * 0.6 * linear / i_rated
    pairs = int(rng.integers(2, 11))
    torque, omega_m = 1.5 * pairs * psi * i_rated, omega / pairs
    machine = {
        "pole_pairs": pairs,
        "resistance_ohm": _digits(r),
        "temperature_ref_c": float(rng.choice((20.0, 25.0))),
        "inductance_d_h": _digits(l_d),
        "inductance_q_h": _digits(l_q),
        "magnet_flux_wb": _digits(psi),
        "rated_current_a": _digits(i_rated, 3),
        "inertia_kgm2": _digits(torque * rng.uniform(0.08, 0.25) / omega_m),
        "viscous_friction_nms": _digits(torque * rng.uniform(0.005, 0.02) / omega_m),
    }
    inverter = {"dc_bus_v": bus, "pwm_frequency_hz": f_pwm}
    control = {"sample_time_s": _digits(1.0 / f_pwm, 9), "duty_applied_after_samples": 1}
    return Nominal(machine, inverter, control, omega, torque, bool(rng.random() < 0.75))


def random_control(rng, n: Nominal, speed_loop: bool) -> P.Control:
    """Controller with random bandwidths, tuned on the nominal machine with random errors."""
    m, T = n.machine, n.period_s
    w = 2.0 * math.pi * min(rng.uniform(150.0, 800.0), 0.06 / T)
    r = m["resistance_ohm"] * rng.uniform(0.7, 1.5)
    care_d, care_q = rng.uniform(0.7, 1.2, 2)
    k_t = 1.5 * m["pole_pairs"] * m["magnet_flux_wb"]
    w_s = min(2.0 * math.pi * rng.uniform(4.0, 15.0), 0.1 * w)
    kp_w = w_s * m["inertia_kgm2"] / (k_t * m["pole_pairs"])
    return P.Control(
        kp_d=w * m["inductance_d_h"] * care_d,
        ki_d=w * r + 0.1 * w * w * m["inductance_d_h"],
        kp_q=w * m["inductance_q_h"] * care_q,
        ki_q=w * r + 0.1 * w * w * m["inductance_q_h"],
        l_d=m["inductance_d_h"],
        l_q=m["inductance_q_h"],
        psi_m=m["magnet_flux_wb"],
        decouple=float(rng.choice((0.0, 1.0), p=(0.2, 0.8))),
        svm=int(n.svm),
        limit=0.96,
        duty_min=max(0.012, 6e-6 / T * 0.5),
        duty_lsb=2.0 * 1e-8 * rng.choice((0.5, 1.0)) / T,
        speed_loop=int(speed_loop),
        kp_w=kp_w,
        ki_w=0.25 * w_s * kp_w,
        i_limit=m["rated_current_a"],
    )


def random_sensor(rng, n: Nominal, ideal: P.Sensor, imposed: bool) -> P.Sensor:
    """Noise, quantisation and filters of healthy sensors."""
    i_rated, bus = n.machine["rated_current_a"], n.inverter["dc_bus_v"]
    full = rng.uniform(1.7, 2.5) * i_rated
    return ideal._replace(
        range_a=full,
        lsb_a=2.0 * full / 2 ** int(rng.integers(12, 17)),
        noise_a=i_rated * 10.0 ** rng.uniform(-3.3, -2.5),
        theta_noise=math.radians(rng.uniform(0.01, 0.05)),
        theta_lsb=2.0 * math.pi / 2 ** int(rng.integers(12, 17)),
        omega_exact=int(imposed and rng.random() < 0.3),
        omega_filter_rad_s=2.0 * math.pi * rng.uniform(80.0, 400.0),
        u_noise=bus * rng.uniform(5e-4, 2e-3),
        u_lsb=1.4 * bus / 2 ** int(rng.integers(12, 15)),
        torque_noise=n.torque_rated * rng.uniform(1e-3, 4e-3),
    )
