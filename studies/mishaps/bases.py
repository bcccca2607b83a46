# SPDX-License-Identifier: BSD-3-Clause
"""Three simulated drives with short recordings: a healthy servo, a warm robot joint, a traction drive.

The simulator is that of the blind study, which is not the estimator's model.  Sensors have ordinary noise and codes.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from studies.blind.build import fresh
from studies.blind.machines import Nominal
from studies.blind.plans import RAMP_S, Plan

SPEEDS = (0.1, -0.4, 0.7, -0.95)  # of the rated speed
POINTS = ((0.0, 0.0), (0.0, 0.9), (-0.5, 0.5), (0.0, -0.6), (-0.7, 0.0), (-0.5, -0.5))  # of the rated current
ROWS = 260  # of a dwell
TURNS = np.exp(2j * np.pi / 3 * np.arange(3))
DELAY = 1  # periods


@dataclass(frozen=True)
class Base:
    """machine: [machine] of the drive file; true: what the machine has instead; bus_v, pwm_hz; omega: rated [rad/s]."""

    name: str
    machine: dict
    true: dict
    bus_v: float
    pwm_hz: float
    omega: float
    seed: int

    def drive(self) -> dict:
        """The document of the drive file."""
        return {
            "machine": dict(self.machine),
            "inverter": {"dc_bus_v": self.bus_v, "pwm_frequency_hz": self.pwm_hz},
            "control": {"sample_time_s": round(1.0 / self.pwm_hz, 9), "duty_applied_after_samples": DELAY},
        }

    def value(self, key: str) -> float:
        """The true value of a key of [machine]."""
        return self.true.get(key, self.machine[key])


def _machine(pairs, r, l_d, l_q, psi, rated, inertia) -> dict:
    return {
        "pole_pairs": pairs, "resistance_ohm": r, "temperature_ref_c": 25.0, "inductance_d_h": l_d,
        "inductance_q_h": l_q, "magnet_flux_wb": psi, "rated_current_a": rated, "inertia_kgm2": inertia,
        "viscous_friction_nms": 1e-4,
    }  # fmt: skip


BASES = {
    base.name: base
    for base in (
        Base("servo", _machine(4, 1.53, 0.01607, 0.01581, 0.165, 5.23, 0.0016), {}, 563.0, 1e4, 900.0, 1),
        Base("robot", _machine(10, 0.12, 1.0e-4, 1.1e-4, 0.006, 20.0, 1e-3), {"resistance_ohm": 0.15}, 48.0, 2e4,
             1900.0, 2),
        Base("traction", _machine(4, 0.02, 3e-4, 6e-4, 0.08, 230.0, 0.05), {"magnet_flux_wb": 0.0744}, 350.0, 1e4,
             700.0, 3),
    )
}  # fmt: skip


@functools.lru_cache
def columns(name: str) -> dict[str, np.ndarray]:
    """Canonical columns (n,) of phase currents, angle, speed, bus and duties of a base."""
    base = BASES[name]
    drive = base.drive()
    m = base.machine
    torque = 1.5 * m["pole_pairs"] * m["magnet_flux_wb"] * m["rated_current_a"]
    nominal = Nominal(m, drive["inverter"], drive["control"], base.omega, torque, svm=True)
    rng = np.random.default_rng([4848, base.seed])
    build = fresh(rng, nominal, Plan(segments(base)), with_torque=False)
    build.with_temp = False
    r = base.value("resistance_ohm")
    build.change("motor", r_a=r, r_b=r, r_c=r, psi_m=base.value("magnet_flux_wb"))
    table, _ = build.record(rng)
    names = ("t", "i_a", "i_b", "i_c", "theta_e", "omega_e", "u_dc", "d_a", "d_b", "d_c")
    return {name: table[name] for name in names}


def segments(base: Base) -> list[tuple[float, float, float, int]]:
    """(omega_e, i_d, i_q, rows) of the dwells; the first one of a speed has the rows of the ramp besides."""
    rated, ramp, out = base.machine["rated_current_a"], round(RAMP_S * base.pwm_hz), []
    for k, speed in enumerate(SPEEDS):
        for j, (d, q) in enumerate(np.roll(POINTS, 2 * k, axis=0)):
            out.append((speed * base.omega, d * rated, q * rated, ROWS + (ramp if j == 0 else 0)))
    return out


@functools.lru_cache
def dq(name: str) -> dict[str, np.ndarray]:
    """The same as the control logs it: dq currents, and references valid in the middle of their period."""
    c, period = columns(name), 1.0 / BASES[name].pwm_hz
    turn = np.exp(1j * c["theta_e"])
    i = 2 / 3 * sum(c[f"i_{x}"] * t for x, t in zip("abc", TURNS, strict=True)) / turn
    u = 2 / 3 * sum(c[f"d_{x}"] * t for x, t in zip("abc", TURNS, strict=True)) * c["u_dc"] / turn
    u = u * np.exp(-1j * c["omega_e"] * period * (DELAY + 0.5))
    log = {n: c[n] for n in ("t", "theta_e", "omega_e", "u_dc")}
    return {**log, "i_d": i.real, "i_q": i.imag, "u_d_ref": u.real, "u_q_ref": u.imag}


@functools.lru_cache
def table(name: str) -> dict[str, np.ndarray]:
    """One row per dwell: the means of its last rows."""
    log, ends = dq(name), np.cumsum([s[3] for s in segments(BASES[name])])
    names = ("i_d", "i_q", "u_d_ref", "u_q_ref", "omega_e", "u_dc")
    return {n: np.array([log[n][e - 160 : e - 4].mean() for e in ends]) for n in names}


@functools.lru_cache
def slow(name: str, hertz=20.0, seconds=2.0) -> dict[str, np.ndarray]:
    """The dwells as a slow log, with noise of a thousandth of rated current and bus."""
    base, points = BASES[name], table(name)
    rng, count = np.random.default_rng([4849, base.seed]), round(hertz * seconds)
    noise = {"i": 1e-3 * base.machine["rated_current_a"], "u": 2e-4 * base.bus_v, "o": 1e-4 * base.omega}
    out = {"t": np.arange(count * len(points["i_d"])) / hertz}
    for n, values in points.items():
        rows = np.repeat(values, count)
        out[n] = rows + noise[n[0]] * rng.standard_normal(len(rows))
    return out


FORMS = {"phases": columns, "dq": dq, "slow": slow, "table": table}
