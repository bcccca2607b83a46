# SPDX-License-Identifier: BSD-3-Clause
"""One recording: simulate a plan and turn the codes into the columns that a drive logs."""

from __future__ import annotations

import numpy as np

from studies.blind.circuit import control, loop, params
from studies.blind.circuit.iron import linkage
from studies.blind.circuit.machine import BUS, LAM_A, LAM_B, SPEED, STATES, THETA

INSIDE = ("i_d", "i_q", "psi_d", "psi_q", "field", "winding", "iron", "magnet", "torque")
STATE = (
    "psi_alpha psi_beta theta speed bus short load eddy_a eddy_b e_in e_copper e_core e_shaft e_bus".split()
)  # fmt: skip


def regulator(drive, sensors, bandwidth) -> params.Control:
    """Gains that give the bandwidth with the drive file's values; a slow winding gets a quicker integrator."""
    scale = sensors.range_a / sensors.range_v
    l = np.sqrt(drive.l_d * drive.l_q)  # noqa: E741
    kp, ki = bandwidth * l * scale, bandwidth * max(drive.r, 0.1 * bandwidth * l) * drive.period * scale
    speed = 2 * np.pi * drive.pole_pairs / (1 << sensors.encoder_bits) / sensors.speed_every / drive.period  # rad/s
    feed = (speed * drive.psi / sensors.range_v * control.ONE * (1 << 16),)
    feed += tuple(speed * x * scale * (1 << 20) for x in (drive.l_d, drive.l_q))
    ticks = int(drive.period / 1e-8 / 2) * 2
    return params.Control(max(1, int(kp * 1024)), max(1, int(ki * (1 << 20))), ticks, *(int(x) for x in feed))


def simulate(rng, drive, real, plan, steps=12):
    """(codes, inside) of a plan; inside: {name: array} of true values at the sampling instants."""
    m, s = real.machine, real.sensors
    total = 9.0 * m.inertia
    speed = 2 * np.pi * 25.0
    bench = params.Bench(8.0 * m.inertia, 1.4 * speed * total, speed**2 * total)
    y = np.zeros(STATES)
    y[THETA], y[SPEED] = rng.uniform(0.0, 2 * np.pi), plan.speed[0]
    y[BUS] = real.inverter.bus * (0.95 if real.inverter.rectifier else 1.0)
    lam = complex(*linkage(m, m.psi, 0.0, 0.0, y[THETA])) * np.exp(1j * y[THETA])
    y[LAM_A], y[LAM_B] = lam.real, lam.imag
    count = len(plan.speed)
    goals = np.stack([plan.i_ref.real, plan.i_ref.imag], axis=1) / s.range_a * control.ONE
    k = regulator(drive, s, plan.bandwidth)
    codes, inside = loop.run(
        m, real.heat, real.inverter, s, k, bench, plan.speed, np.round(goals).astype(np.int64),
        rng.standard_normal((count, 4)), steps, control.TABLE, y, np.full(3, 25.0),
    )  # fmt: skip
    return codes, dict(zip((*INSIDE, *STATE), inside.T, strict=True)), k


def columns(rng, drive, real, simulated, torque, temperature) -> dict:
    """The columns of the recording."""
    codes, inside, k = simulated
    s, p, h = real.sensors, drive.pole_pairs, drive.period
    count = len(codes)
    turn = 2 * np.pi / (1 << s.encoder_bits)
    angle = codes[:, 3] * turn * p + s.angle
    out = {"t": np.arange(count) * h}
    out |= {f"i_{x}": codes[:, n] * s.range_a / (1 << (s.bits - 1)) for n, x in enumerate("abc")}
    out["theta_e"] = (angle + np.pi) % (2 * np.pi) - np.pi
    out["omega_e"] = codes[:, 5] * turn * p / (s.speed_every * h)
    out["u_dc"] = codes[:, 4] * s.range_v / 4096.0
    out |= {f"d_{x}": codes[:, 6 + n] / k.ticks for n, x in enumerate("abc")}
    if torque:
        rated = 1.5 * p * drive.psi * drive.current
        out["torque"] = inside["torque"] + 0.003 * rated * rng.standard_normal(count)
    if temperature:
        out["temp_winding"] = codes[:, 9] / 2.0
    return out


def sound(kept, drive, plan) -> bool:
    """Whether the drive followed: the currents at their references, hardly any duty at its limit."""
    i = np.abs(np.stack([kept[k] for k in ("i_a", "i_b", "i_c")]))
    d = np.stack([kept[k] for k in ("d_a", "d_b", "d_c")])
    turns = np.exp(2j * np.pi / 3 * np.arange(3))
    seen = 2 / 3 * turns @ np.stack([kept[k] for k in ("i_a", "i_b", "i_c")]) * np.exp(-1j * kept["theta_e"])
    error = [abs(np.mean((seen - plan.i_ref)[a:b])) for a, b in plan.held]
    fine = np.isfinite(i).all() and np.quantile(i, 0.999) < 1.35 * drive.current
    return bool(fine and max(error) < 0.05 * drive.current and np.mean((d <= 0.0201) | (d >= 0.9799)) < 0.01)
