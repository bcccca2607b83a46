# SPDX-License-Identifier: BSD-3-Clause
"""What a drive is asked to do: points on a test bench, a torque cycle, or a speed cycle of a free shaft."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ROWS_MAX = 46000


@dataclass
class Plan:
    """goal (n + 1,): electrical speed [rad/s]; i_ref (n,): complex [A]; load (n,) [Nm]; fan [Nm s^2]."""

    mode: str
    goal: np.ndarray
    i_ref: np.ndarray
    load: np.ndarray
    held: tuple  # (first, last) rows in which a point is held
    fan: float = 0.0
    first: int = 0  # row at which the logger starts

    @property
    def free(self) -> bool:
        return self.mode == "speed"


def top_speed(drive, points) -> float:
    """Largest electrical speed [rad/s] at which all points (i_d, i_q) leave a reserve of voltage."""
    omega = 2 * np.pi * 0.06 / drive.period
    while max(drive.voltage(s * omega, d, q) for d, q in points for s in (1.0, -1.0)) > drive.base:
        omega *= 0.97
    return omega


def course(drive, points, rows, speed_ramp, current_ramp):
    """Columns of points (omega_e, i_d, i_q, load) one after the other; ramps in rad/s^2 and A/s."""
    h = drive.period
    goal, i_ref, load, held = [], [], [], []
    last = None
    for omega, d, q, torque in points:
        i = complex(d, q)
        if last is not None:
            n = int(np.ceil(abs(omega - last[0]) / speed_ramp / h))
            n = max(n, int(np.ceil(abs(i - last[1]) / current_ramp / h)) if current_ramp else 0)
            if n:
                x = np.arange(n) / n
                goal.append(last[0] + (omega - last[0]) * x)
                i_ref.append(last[1] + (i - last[1]) * x if current_ramp else np.full(n, i))
                load.append(np.full(n, last[2]))
        first = sum(len(x) for x in goal)
        goal.append(np.full(rows, omega))
        i_ref.append(np.full(rows, i))
        load.append(np.full(rows, torque))
        held.append((first, first + rows))
        last = omega, i, torque
    goal = np.concatenate(goal)
    return np.append(goal, goal[-1]), np.concatenate(i_ref), np.concatenate(load), tuple(held)


def _ramps(rng, drive, top):
    """Ramps of speed [rad/s^2] and current [A/s]; 0: the current steps."""
    return top / rng.uniform(0.03, 0.08), float(rng.choice((0.0, drive.current / rng.uniform(0.004, 0.015))))


def _fit(points, rows, drive, ramps=0.02):
    """As many points as the longest recording takes; ramps: their time for each point [s]."""
    return points[: max(6, int(ROWS_MAX / (rows + ramps / drive.period)))]


def bench(rng, drive, turns=0.0) -> Plan:
    """Imposed speeds, a grid of currents at each; turns: mechanical ones within a point at middle speed."""
    a = 0.92 * drive.current
    side, high, low = rng.uniform(0.4, 0.7), rng.uniform(0.78, 1.0), rng.uniform(0.2, 0.45)
    cells = [(0.0, high), (0.0, -high), (-side, 0.6), (0.0, low), (-0.5 * side, -0.55), (-side, 0.0), (0.0, -low)]
    if rng.random() < 0.4:
        cells[-1] = (0.3 * side, -low)
    cells = [(d * a, q * a) for d, q in cells[: int(rng.integers(5, 8))]]
    top = top_speed(drive, cells)
    speeds = [0.06 * rng.choice((-1, 1)), rng.uniform(0.25, 0.45), -rng.uniform(0.4, 0.6), rng.uniform(0.8, 1.0)]
    speeds += [-rng.uniform(0.7, 0.95)][: int(rng.integers(0, 2))]
    rng.shuffle(speeds)
    rows = int(max(700, rng.uniform(0.06, 0.09) / drive.period))
    rows = int(np.clip(turns * 2 * np.pi * drive.pole_pairs / (0.4 * top * drive.period), rows, 1600))
    points = []
    for s in speeds:
        points += [(s * top, cells[k][0], cells[k][1], 0.0) for k in rng.permutation(len(cells))]
    if len(points) > len(_fit(points, rows, drive)):
        keep = np.sort(rng.permutation(len(points))[: len(_fit(points, rows, drive))])
        points = [points[k] for k in keep]
    return Plan("bench", *course(drive, points, rows, *_ramps(rng, drive, top)))


def cycle(rng, drive, turns=0.0) -> Plan:
    """Imposed speeds of a drive cycle with torques both ways along a line of i_d over i_q, some of it weakened."""
    a, ratio = 0.92 * drive.current, drive.ratio()
    angle = np.arctan(ratio)
    levels = [0.95, -0.9, 0.55, -0.5, 0.25, -0.2, 0.75, 0.0]
    line = [(-abs(x) * a * np.sin(angle), x * a * np.cos(angle)) for x in levels]
    weak = [(-0.45 * a, 0.5 * a), (-0.6 * a, -0.3 * a), (0.0, 0.4 * a)]
    top = top_speed(drive, line + weak)
    shape = [0.05, 0.3, 0.6, 0.9, 0.5, -0.07, -0.45, -0.95, -0.6][: int(rng.integers(6, 10))]
    turned = -1.0 if rng.random() < 0.5 else 1.0
    rows = int(max(700, rng.uniform(0.06, 0.09) / drive.period))
    rows = int(np.clip(turns * 2 * np.pi * drive.pole_pairs / (0.4 * top * drive.period), rows, 1600))
    points = []
    for s in shape:
        picked = [line[k] for k in rng.permutation(len(line))[:3]] + [weak[int(rng.integers(len(weak)))]]
        points += [(turned * s * rng.uniform(0.95, 1.05) * top, d, q, 0.0) for d, q in picked]
    return Plan("cycle", *course(drive, _fit(points, rows, drive), rows, *_ramps(rng, drive, top)))


def speed(rng, drive, turns=0.0) -> Plan:
    """A free shaft: speeds both ways with load steps at each."""
    a, angle = 0.92 * drive.current, np.arctan(drive.ratio())
    line = [(-a * np.sin(angle), a * np.cos(angle)), (0.0, 0.0)]
    top = top_speed(drive, line)
    rated = drive.rated_torque
    shape = [s * rng.uniform(0.9, 1.1) for s in (0.1, -0.12, 0.4, -0.45, 0.85, -0.8)][: int(rng.integers(4, 7))]
    loads = [0.6, -0.45, 0.2, 0.0, -0.25]
    rows = int(np.clip(rng.uniform(0.12, 0.17) / drive.period, 1000, 2600))
    points = []
    for s in rng.permutation(shape):
        picked = rng.permutation(loads)[: int(rng.integers(3, 5))]
        points += [(s * top, 0.0, 0.0, x * rated) for x in picked]
    ramp = rng.uniform(0.15, 0.3) * rated / drive.inertia * drive.pole_pairs
    goal, i_ref, load, held = course(drive, _fit(points, rows, drive, 0.04), rows, ramp, 0.0)
    fan = float(rng.choice((0.0, 0.15))) * rated / (top / drive.pole_pairs) ** 2
    return Plan("speed", goal, i_ref, load, held, fan)


def _settled(drive) -> int:
    """Rows until the current stands, which the logger leaves out: the start would tell what the points do not."""
    return int(0.08 / drive.period)


def one_point(rng, drive) -> Plan:
    """One imposed speed and one current, i_d = 0."""
    q = float(rng.choice((-1.0, 1.0))) * rng.uniform(0.5, 0.9) * drive.current
    omega = rng.uniform(0.35, 0.8) * top_speed(drive, [(0.0, q), (0.0, -q)])
    return Plan("bench", *course(drive, [(omega, 0.0, q, 0.0)], 14000, 1.0, 0.0), first=_settled(drive))


def one_current(rng, drive) -> Plan:
    """Several imposed speeds, always the same current, i_d = 0."""
    q = float(rng.choice((-1.0, 1.0))) * rng.uniform(0.6, 0.9) * drive.current
    top = top_speed(drive, [(0.0, q), (0.0, -q)])
    points = [(s * top, 0.0, q, 0.0) for s in rng.permutation([0.08, -0.1, 0.4, -0.5, 0.7, 0.95, -0.85])]
    return Plan(
        "bench", *course(drive, points, int(max(1500, 0.1 / drive.period)), top / 0.3, 0.0), first=_settled(drive)
    )
