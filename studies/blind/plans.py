# SPDX-License-Identifier: BSD-3-Clause
"""Operating plans: the speeds and currents of a recording, and the resulting courses.

A plan is a list of segments; courses are arrays with one value per row (params.Course).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from studies.blind import params as P
from studies.blind.machines import Nominal

RAMP_S = 0.03


@dataclass
class Plan:
    """segments: (omega_e, i_d, i_q, rows) each; load: Nm per segment of a free shaft under speed control."""

    segments: list[tuple[float, float, float, int]]
    free: bool = False
    load: list[float] = field(default_factory=list)
    ripple: tuple[float, float, float] = (0.0, 300.0, 0.0)  # share of the bus, Hz, phase
    bus_v: float | None = None
    swing: tuple[float, float] = (0.0, 0.0)  # share of the speed, Hz: speed oscillates within a segment

    @property
    def rows(self):
        return sum(segment[3] for segment in self.segments)


def _fits(n: Nominal, omega, i_d, i_q):
    return n.voltage(omega, i_d, i_q) <= 0.8 * n.voltage_limit


def _top_speed(n: Nominal, points):
    """Highest electrical speed at which every point has a voltage reserve, at most the rated one."""
    omega = n.omega_rated
    while omega > 0.05 * n.omega_rated and not all(_fits(n, s * omega, d, q) for d, q in points for s in (1, -1)):
        omega *= 0.97
    return omega


def current_points(rng, i_rated, with_d=True):
    """Four to eight (i_d, i_q): both signs of i_q, i_d zero and (with_d) negative."""
    low, high, negative = rng.uniform(0.2, 0.45), rng.uniform(0.75, 1.0), -rng.uniform(0.4, 0.75)
    must = [(0.0, high), (0.0, -high), (0.0, low)]
    side = math.sqrt(max(0.0, 0.95 - negative**2))
    extra = [(0.0, 0.0), (0.0, -low)]
    if with_d:
        must += [(negative, 0.0), (negative, side * rng.uniform(0.6, 1.0))]
        must += [(0.5 * negative, -side * rng.uniform(0.3, 0.7))]  # a second level separates L_d from saturation
        extra += [(negative, -side), (0.7 * negative, -low)]
    rng.shuffle(extra)
    points = must + extra[: rng.integers(1, min(4, len(extra) + 1))]
    rng.shuffle(points)
    return [(d * i_rated, q * i_rated) for d, q in points]


def _ripple(rng):
    return (
        float(rng.choice((0.0, rng.uniform(0.001, 0.012)))),
        float(rng.choice((100.0, 300.0))),
        rng.uniform(0, 6),
    )


def grid_plan(rng, n: Nominal, with_d=True) -> Plan:
    """Speeds in both directions times current points, on a shaft whose speed is imposed."""
    points = current_points(rng, n.machine["rated_current_a"], with_d)
    top = _top_speed(n, points)
    speeds = [0.06, -0.06, rng.uniform(0.3, 0.5), -rng.uniform(0.3, 0.5), rng.uniform(0.85, 1.0)]
    more = [-rng.uniform(0.85, 1.0), rng.uniform(0.6, 0.75), 0.15]
    speeds += more[: rng.integers(0, 4)]
    rng.shuffle(speeds)
    dwell = rng.uniform(0.04, 0.12)
    count = len(speeds) * len(points)
    rows = int(np.clip(count * dwell / n.period_s, 30e3, 110e3) / count)
    segments = [(s * top, *point, rows) for s in speeds for point in rng.permutation(points)]
    return Plan(segments, ripple=_ripple(rng))


def one_point_plan(rng, n: Nominal) -> Plan:
    """One speed and one pair of currents for the whole recording."""
    point = current_points(rng, n.machine["rated_current_a"], with_d=rng.random() < 0.5)[0]
    top = _top_speed(n, [point])
    omega = float(rng.choice((0.1, 0.4, 0.9))) * rng.uniform(0.8, 1.1) * top * rng.choice((1, -1))
    return Plan([(float(omega), *map(float, point), int(rng.integers(8000, 20000)))], ripple=_ripple(rng))


def masked_plan(rng, n: Nominal) -> Plan:
    """Speed references and load steps on a free shaft, so that both loops mask the effects."""
    i_rated = n.machine["rated_current_a"]
    points = [(0.0, i_rated), (0.0, -i_rated), (-0.4 * i_rated, 0.8 * i_rated)]
    top = _top_speed(n, points)
    speeds = rng.permutation([0.1, -0.1, 0.45, -0.5, 0.9, -0.85, 0.7][: rng.integers(5, 8)])
    rows = int(np.clip(0.25 / n.period_s / 2, 1200, 3500))
    segments, load = [], []
    for s in speeds:
        for part in rng.permutation([0.7, -0.6, 0.2, 0.0]):
            segments.append((s * top, float(rng.choice((0.0, 0.0, -0.4))) * i_rated, 0.0, rows))
            load.append(part * n.torque_rated)
    return Plan(segments, free=True, load=load, ripple=_ripple(rng))


def steps(plan: Plan, column: int):
    """A value of the segments for each row, shape (n,)."""
    return np.repeat([segment[column] for segment in plan.segments], [segment[3] for segment in plan.segments])


def course(plan: Plan, n: Nominal) -> P.Course:
    """The plan's courses without any effect; speeds change along ramps."""
    rows, T = plan.rows, n.period_s
    omega = steps(plan, 0).astype(float)
    reach = max(1, int((6.0 if plan.free else 1.0) * RAMP_S / T))
    start = np.flatnonzero(np.diff(omega)) + 1
    for k in start:
        stop = min(rows, k + reach)
        omega[k:stop] = np.linspace(omega[k - 1], omega[k], reach + 1)[1 : stop - k + 1]
    t = np.arange(rows + 1) * T
    omega = np.append(omega, omega[-1]) / n.machine["pole_pairs"]
    omega *= 1.0 + plan.swing[0] * np.sin(2.0 * math.pi * plan.swing[1] * t)
    share, hertz, phase = plan.ripple
    u_dc = (plan.bus_v or n.inverter["dc_bus_v"]) * (1.0 + share * np.cos(2.0 * math.pi * hertz * t + phase))
    load = np.repeat(plan.load, [s[3] for s in plan.segments]) if plan.load else np.zeros(rows)
    one = np.ones(rows + 1)
    return P.Course(
        u_dc,
        0.0 * one,
        omega,
        np.append(load, load[-1]).astype(float),
        np.ones((3, rows + 1)),
        one.copy(),
        np.zeros((3, rows + 1)),
        0.0 * one,
        steps(plan, 1).astype(float),
        steps(plan, 2).astype(float),
    )
