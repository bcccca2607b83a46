# SPDX-License-Identifier: BSD-3-Clause
"""One recording: the healthy drive of a drive file, and the columns that the simulation gives."""

from __future__ import annotations

import numpy as np

from studies.blind.sealed import params as P
from studies.blind.sealed.faults import Real
from studies.blind.sealed.loop import INSIDE, ROWS, run


def healthy(rng, drive, plan, current_bits: int) -> Real:
    """A real drive as its file says, with converters, encoder and supply of a random quality."""
    machine = P.Machine(
        float(drive.pole_pairs), drive.r, drive.l_d, drive.l_q, drive.psi, inertia=drive.inertia, viscous=drive.viscous
    )
    r_source = rng.uniform(0.002, 0.02) * drive.bus / drive.current
    inverter = P.Inverter(
        drive.period, drive.bus, r_source, rng.uniform(0.8e-3, 3e-3) / r_source, ripple=rng.uniform(0.0, 0.008),
        i_rated=drive.current, steps=int(rng.integers(20, 25)),
    )  # fmt: skip
    range_a = rng.uniform(1.3, 1.8) * drive.current
    lsb = 2.0 * range_a / 2**current_bits
    least = int(np.ceil(np.log2(360.0 * drive.pole_pairs / 2.0)))  # a code is at most two electrical degrees
    lag = rng.uniform(0.005, 0.02) * drive.period  # of the filter; the converters sample later by as much
    resolver = bool(rng.random() < 0.3)
    bits = int(rng.integers(max(10, least), 17 if resolver else 19))
    sensors = P.Sensors(
        np.zeros(3), np.ones(3), lsb, max(rng.uniform(0.3, 0.8) * lsb, 2e-4 * drive.current),
        tau=lag, skew=lag, range_a=range_a, kind=P.RESOLVER if resolver else P.ENCODER,
        angle_lsb=2.0 * np.pi / 2**bits, angle_noise=rng.uniform(1e-4, 1e-3) / drive.pole_pairs if resolver else 0.0,
        track=2.0 * np.pi * rng.uniform(250.0, 900.0), bus_lsb=1.35 * drive.bus / 2 ** int(rng.integers(11, 15)),
        bus_noise=rng.uniform(1e-4, 6e-4) * drive.bus, bus_tau=rng.uniform(0.0, 0.3) * drive.period,
    )  # fmt: skip
    return Real(machine, inverter, sensors, len(plan.i_ref) * drive.period)


def controller(rng, drive, plan, slow: bool) -> P.Control:
    """A controller that believes the drive file; slow: leaves a margin for more delay."""
    fastest = (0.14 if slow else 0.28) / drive.period
    bandwidth = float(np.exp(rng.uniform(np.log(2 * np.pi * 60.0), np.log(max(fastest, 2 * np.pi * 90.0)))))
    speed_filter = 2 * np.pi * (rng.uniform(70.0, 140.0) if plan.free else rng.uniform(40.0, 130.0))
    complex_vector = bool(rng.random() < 0.5)
    # Without it the discrete complex-vector regulator is unstable where omega^2 T / 2 exceeds R / L.
    damping = rng.uniform(0.3, 0.8) if complex_vector or rng.random() < 0.3 else 0.0
    return P.Control(
        float(drive.pole_pairs), drive.r, drive.l_d, drive.l_q, drive.psi, drive.current, drive.inertia, drive.period,
        bandwidth, complex_vector, damping, plan.free,
        min(2 * np.pi * rng.uniform(12.0, 25.0), bandwidth / 6.0, speed_filter / 4.0), speed_filter,
        drive.ratio() if plan.free else 0.0, int(rng.choice((P.SINE, P.MIDDLE, P.THIRD))),
        float(rng.choice((1000, 2500, 5000, 10000))),
    )  # fmt: skip


def simulate(rng, drive, real, plan, control):
    """(columns, inside) of the closed loop, each a dict of arrays (n,)."""
    n = len(plan.i_ref)
    rows, inside = run(
        real.machine, real.inverter, real.sensors, control, plan.goal / drive.pole_pairs, plan.i_ref, plan.load,
        plan.fan, plan.free, float(rng.uniform(-np.pi, np.pi)), rng.standard_normal((n, 5)),
    )  # fmt: skip
    return dict(zip(ROWS, rows.T, strict=True)), dict(zip(INSIDE, inside.T, strict=True))


def recorded(rng, drive, columns, first, with_torque, with_temperature, with_references) -> dict:
    """The columns that the drive's logger keeps, from row ``first`` on."""
    columns = {name: x[first:] for name, x in columns.items()}
    kept = {name: columns[name].copy() for name in ROWS[:10]}
    if with_references:
        kept |= {name: columns[name].copy() for name in ("i_d_ref", "i_q_ref")}
    if with_torque:
        step = 3.0 * drive.rated_torque / 2**13
        noisy = columns["torque"] + 0.003 * drive.rated_torque * rng.standard_normal(len(columns["t"]))
        kept["torque"] = np.round(noisy / step) * step
    if with_temperature:
        kept["temp_winding"] = np.round(columns["temp_winding"] + 0.15 * rng.standard_normal(len(columns["t"])), 1)
    return kept


def sound(columns, drive, plan) -> bool:
    """Whether the drive followed: no runaway, hardly a duty at its limit, speed and currents near their references."""
    i = np.abs(np.stack([columns[k] for k in ("i_a", "i_b", "i_c")]))
    d = np.stack([columns[k] for k in ("d_a", "d_b", "d_c")])
    if not np.isfinite(i).all() or not np.isfinite(d).all() or np.quantile(i, 0.999) > 1.25 * drive.current:
        return False
    if np.mean((d < 0.021) | (d > 0.979)) > 0.005:
        return False
    turns = np.exp(2j * np.pi / 3 * np.arange(3))
    z = 2 / 3 * np.stack([columns[f"i_{x}"] for x in "abc"], axis=1) @ turns * np.exp(-1j * columns["theta_e"])
    late = np.concatenate([np.arange((a + 2 * b) // 3, b) for a, b in plan.held])
    error = z - columns["i_d_ref"] - 1j * columns["i_q_ref"]
    slow = np.abs(columns["omega_e"] - plan.goal[:-1])[late]
    limit = 0.06 * np.abs(plan.goal).max()
    return bool(np.sqrt(np.mean(np.abs(error[late]) ** 2)) < 0.12 * drive.current and np.median(slow) < limit)
