# SPDX-License-Identifier: BSD-3-Clause
"""One recording: plan, closed loop, columns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

RAMP_S = 0.04
AGE_S = 0.01  # how often what warms up is brought up to date


@dataclass
class Plan:
    """Points held one after the other: (omega_e, i_d, i_q, load torque); rows: of each; free: shaft not imposed."""

    points: list[tuple[float, float, float, float]]
    rows: int
    free: bool = False
    torque: bool = False
    temperature: bool = False
    switching: bool = False
    current_bits: int = 12
    angle_bits: int = 14
    bandwidth: float = 2 * np.pi * 200
    course: object = field(default=None, repr=False)

    def speed(self, drive):
        """The mechanical speed as a function of time, with ramps between the points."""
        t, w, step = [], [], self.rows * drive.period
        for k, (omega, *_) in enumerate(self.points):
            t += [k * step + (RAMP_S if k else 0.0), (k + 1) * step]
            w += [omega / drive.pole_pairs] * 2
        t, w = np.array(t), np.array(w)
        return lambda x: float(np.interp(x, t, w))


class Voltages:
    """Leg voltages waiting to be applied: those of a control period follow each other, as late as the truth says."""

    def __init__(self, drive, truth, switching):
        self.period = drive.period
        self.queue = [[drive.period + truth.late, np.full(3, 0.5)]]
        self.carrier = None
        if switching:
            from motulator.common.model import CarrierComparison

            self.carrier = CarrierComparison(N=2**14, return_complex=False)

    def add(self, duties):
        """The voltages of one more period."""
        if self.carrier is None:
            self.queue.append([self.period, np.array(duties)])
            return
        for _ in range(2):
            times, legs = self.carrier(self.period / 2, duties)
            self.queue += [[t, np.asarray(x, float)] for t, x in zip(times, legs, strict=False) if t > 0.0]

    def apply(self, plant, seconds):
        """Advance the plant by a time."""
        while seconds > 1e-12:
            part = self.queue[0]
            step = min(seconds, part[0])
            plant.advance(step, part[1])
            seconds -= step
            part[0] -= step
            if part[0] <= 1e-12:
                self.queue.pop(0)


def record(plant_type, control_type, sensors_type, drive, truth, plan, rng) -> dict:
    """The columns of a recording."""
    imposed = None if plan.free else plan.speed(drive)
    plant = plant_type(drive, truth, imposed)
    control = control_type(drive, plan.bandwidth, plan.free, rng)
    sensors = sensors_type(drive, truth, rng, plan.current_bits, plan.angle_bits)
    sensors.start(0.0 if plan.free else plan.points[0][0])
    goal = plan.speed(drive)
    voltages = Voltages(drive, truth, plan.switching)
    count, h = plan.rows * len(plan.points), drive.period
    every, rated = max(1, int(AGE_S / h)), 1.5 * drive.pole_pairs * max(drive.psi, 1e-9) * drive.current
    names = ["t", "i_a", "i_b", "i_c", "theta_e", "omega_e", "u_dc", "d_a", "d_b", "d_c"]
    rows = np.empty((count, len(names)))
    torque, warmth = np.empty(count), np.empty(count)
    for k in range(count):
        share = k / count
        omega, i_d, i_q, load = plan.points[k // plan.rows]
        if k % every == 0:
            plant.age(share)
        plant.load = load
        plant.bus = drive.bus * (1.0 + truth.bus_ripple * np.cos(2 * np.pi * 300.0 * k * h))
        if truth.skew < 0.0:
            i_abc = plant.currents()
            voltages.apply(plant, -truth.skew)
        angle, speed, airgap = plant.shaft()
        if truth.skew >= 0.0:
            voltages.apply(plant, truth.skew)
            i_abc = plant.currents()
        seen = sensors(i_abc, angle, plant.bus, share)
        reference = goal(k * h) * drive.pole_pairs if plan.free else omega
        duties, _ = control(seen, reference, complex(i_d, i_q))
        voltages.add(duties)
        rows[k] = (k * h, *seen["i_abc"], seen["theta_e"], seen["omega_e"], seen["u_dc"], *duties)
        if plan.free:
            torque[k] = load
        else:
            slope = (imposed(k * h + 1e-5) - imposed(k * h - 1e-5)) / 2e-5
            torque[k] = airgap - plant.drag(angle, speed) - drive.inertia * slope
        warmth[k] = 25.0 + truth.warm_r * (1.0 - np.exp(-2.5 * share)) / 0.00393
        voltages.apply(plant, h - abs(truth.skew))
    columns = {name: rows[:, j] for j, name in enumerate(names)}
    if plan.torque:
        columns["torque"] = torque + 0.004 * rated * rng.standard_normal(count)
    if plan.temperature:
        columns["temp_winding"] = np.round(warmth + 0.2 * rng.standard_normal(count), 1)
    return columns


def sound(columns, drive) -> bool:
    """Whether the drive followed: no runaway, hardly any duty at its limit."""
    i = np.abs(np.stack([columns[k] for k in ("i_a", "i_b", "i_c")]))
    d = np.stack([columns[k] for k in ("d_a", "d_b", "d_c")])
    fine = np.isfinite(i).all() and np.quantile(i, 0.999) < 1.25 * drive.current
    return bool(fine and np.mean((d <= 0.0201) | (d >= 0.9799)) < 0.01)
