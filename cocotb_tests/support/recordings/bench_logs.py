# SPDX-License-Identifier: BSD-3-Clause
"""Recordings that are no log of a running control: tables of operating points, EMF runs, one point that warms up.

The machine is that of drives.py; its equations are written down here once more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cocotb_tests.support.drives import L_D, L_Q, PAIRS, PSI, R

GRID = [
    (w, d, q)
    for w in (80.0, 250.0, 500.0, -300.0)
    for d, q in ((0.0, 0.0), (0.0, 2.0), (0.0, 4.5), (-2.0, 3.0), (0.0, -3.0), (-3.0, 0.0), (1.5, -2.0))
]


@dataclass(frozen=True)
class Truth:
    """The machine behind a recording; ``v_dead`` [V] is the inverter's loss of a leg, without a slope at zero."""

    r: float = R
    l_d: float = L_D
    l_q: float = L_Q
    psi: float = PSI
    v_dead: float = 0.0
    offset: float = 0.0  # rad, of the drive's angle


TURNS = np.exp(-2j * np.pi / 3 * np.arange(3))


def voltage(truth: Truth, i, omega, theta=None, r=None, psi=None):
    """Requested dq voltage (n,) [V] at dq currents i [A]; the inverter's loss is a mean over a turn, or at theta."""
    r, psi = truth.r if r is None else r, truth.psi if psi is None else psi
    true = i * np.exp(1j * truth.offset)
    u = r * true + 1j * omega * (truth.l_d * true.real + psi + 1j * truth.l_q * true.imag)
    u = u * np.exp(-1j * truth.offset)
    if theta is None:
        return u + 4 / np.pi * truth.v_dead * np.where(np.abs(i) > 0.01, np.exp(1j * np.angle(i)), 0.0)
    legs = np.sign(((i * np.exp(1j * theta))[:, None] * TURNS).real) * (np.abs(i) > 0.01)[:, None]
    return u + truth.v_dead * (2 / 3) * (legs @ np.conj(TURNS)) * np.exp(-1j * theta)


def table(truth: Truth = Truth(), points=GRID, noise_v=0.05, noise_a=0.003, repeats=1, seed=3, theta=None) -> dict:
    """One row per operating point (speed [rad/s], i_d, i_q [A]), without a time."""
    rng = np.random.default_rng(seed)
    omega, i_d, i_q = (np.repeat(x, repeats) for x in np.array(points, float).T)
    n = len(omega)
    u = voltage(truth, i_d + 1j * i_q, omega, theta)
    out = {
        "i_d": i_d + noise_a * rng.standard_normal(n),
        "i_q": i_q + noise_a * rng.standard_normal(n),
        "u_d_ref": u.real + noise_v * rng.standard_normal(n),
        "u_q_ref": u.imag + noise_v * rng.standard_normal(n),
        "omega_e": omega,
    }
    return out if theta is None else out | {"theta_e": theta}


def with_torque(columns: dict, truth: Truth = Truth(), friction=0.0, scale=1.0, noise_nm=0.003, seed=8) -> dict:
    """The same table with the torque of a transducer at the shaft [Nm], and currents recorded at ``scale``.

    friction: dry torque against the motion [Nm].
    """
    i_d, i_q = columns["i_d"], columns["i_q"]
    torque = 1.5 * PAIRS * (truth.psi + (truth.l_d - truth.l_q) * i_d) * i_q
    torque = torque - friction * np.sign(columns["omega_e"])
    noise = noise_nm * np.random.default_rng(seed).standard_normal(len(torque))
    return columns | {"i_d": scale * i_d, "i_q": scale * i_q, "torque": torque + noise}


def warming(hours=2.0, step_s=2.0, magnets=-0.05, copper=0.0039, rise_k=40.0, i=-1.0 + 4j, omega=400.0, seed=5) -> dict:
    """One operating point while winding and magnets warm up, a row every step_s: with the winding's temperature.

    magnets: change of the magnet flux at the end, relative; the winding warms with a shorter time constant.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, hours * 3600.0, step_s)
    n = len(t)
    rise = rise_k * (1.0 - np.exp(-t / 900.0))
    share = (1.0 - np.exp(-t / 3000.0)) / (1.0 - np.exp(-t[-1] / 3000.0))
    u = voltage(Truth(), i, omega, r=R * (1.0 + copper * rise), psi=PSI * (1.0 + magnets * share))
    noisy = lambda x, s: x + s * rng.standard_normal(n)  # noqa: E731
    return {
        "t": t, "i_d": noisy(i.real, 0.01), "i_q": noisy(i.imag, 0.01), "u_d_ref": noisy(u.real, 0.05),
        "u_q_ref": noisy(u.imag, 0.05), "omega_e": np.full(n, omega), "temp_winding": noisy(20.0 + rise, 0.2),
    }  # fmt: skip


def emf(speeds=(150.0, 400.0), seconds=0.5, rate=50e3, psi=0.97 * PSI, fifth=0.0, noise_v=0.2, seed=6) -> dict:
    """Terminal voltages of a driven machine with its gates off: t, u_a, u_b, u_c [V] against the star, omega_e.

    fifth: amplitude of the fifth harmonic of the phase voltage relative to the fundamental.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds * rate)
    omega = np.concatenate([np.full(n, w) for w in speeds])
    t = np.arange(len(omega)) / rate
    theta = 0.4 + np.cumsum(np.append(0.0, omega[:-1])) / rate
    angles = theta[:, None] - 2 * np.pi / 3 * np.arange(3)
    e = -omega[:, None] * psi * (np.sin(angles) + fifth * np.sin(5 * angles))
    e += noise_v * rng.standard_normal(e.shape)
    return {"t": t, "u_a": e[:, 0], "u_b": e[:, 1], "u_c": e[:, 2], "omega_e": omega}


def sampled(hertz=500.0, truth: Truth = Truth(), points=GRID, hold_s=1.0, ramp_s=0.2, angle=True, seed=7) -> dict:
    """A log of ``hertz`` rows per second of a drive that goes through the points, without messages."""
    rng = np.random.default_rng(seed)
    corners, levels = [0.0], [points[0]]
    for k, point in enumerate(points):
        if k:
            corners, levels = [*corners, corners[-1] + ramp_s], [*levels, point]
        corners, levels = [*corners, corners[-1] + hold_s], [*levels, point]
    t = np.arange(0.0, corners[-1], 1.0 / hertz)
    omega, i_d, i_q = (np.interp(t, corners, x) for x in np.array(levels).T)
    theta = np.mod(np.cumsum(np.append(0.0, 0.5 * (omega[1:] + omega[:-1]))) / hertz, 2 * np.pi)
    u = voltage(truth, i_d + 1j * i_q, omega, theta)
    noisy = lambda x, s: x + s * rng.standard_normal(len(t))  # noqa: E731
    out = {"t": t, "i_d": noisy(i_d, 0.02), "i_q": noisy(i_q, 0.02), "omega_e": noisy(omega, 0.1)}
    out |= {"u_d_ref": noisy(u.real, 0.2), "u_q_ref": noisy(u.imag, 0.2)}
    return out | {"theta_e": theta} if angle else out
