# SPDX-License-Identifier: BSD-3-Clause
"""Builder of one drive: forms.py adds effects one by one, ``record`` simulates it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from studies.blind import params as P
from studies.blind import plans
from studies.blind.machines import Nominal, random_control, random_sensor
from studies.blind.simulator import simulate


@dataclass
class Build:
    """Nominal drive, true drive and plan.  ``on_course``: changes of the external courses, in order.

    Each takes (course, x, recording) with x (n + 1,) the elapsed share of the recording, and
    changes the arrays in place; ``columns`` may add recorded channels through ``channels``.
    """

    nominal: Nominal
    drive: P.Drive
    plan: plans.Plan
    with_torque: bool
    with_temp: bool
    file_kind: str
    on_course: list[Callable] = field(default_factory=list)
    temperature: Callable | None = None  # (x, rng) -> thermocouple reading [degC]

    def change(self, part: str, **values):
        """Replace fields of drive.motor, .bridge, .shaft, .sensor or .control."""
        self.drive = self.drive._replace(**{part: getattr(self.drive, part)._replace(**values)})

    def record(self, rng, plan=None, trace=False, x_start=0.0):
        """(columns of the recording of a plan (default: the case's own), trace or None).

        x_start: progress of drifts at the start, 0 (cold) to 1 (as at the end of the case's recording).
        """
        plan = plan or self.plan
        course = plans.course(plan, self.nominal)
        x = np.linspace(x_start, 1.0, plan.rows + 1)
        for change in self.on_course:
            change(course, x)
        drive = self.drive._replace(shaft=self.drive.shaft._replace(free=int(plan.free)))
        drive = drive._replace(control=drive.control._replace(speed_loop=int(plan.free)))
        columns, held = simulate(drive, course, rng, rng.uniform(0.0, 2.0 * np.pi), trace=trace)
        if not self.with_torque:
            del columns["torque"]
        if self.with_temp:
            reference = self.nominal.machine["temperature_ref_c"]
            reading = self.temperature(x[:-1]) if self.temperature else np.full(plan.rows, reference)
            columns["temp_winding"] = reading + 0.05 * rng.standard_normal(plan.rows)
        return columns, held


def fresh(rng, nominal: Nominal, plan: plans.Plan, with_torque: bool) -> Build:
    """A healthy drive with typical sensors and a randomly tuned controller."""
    control = random_control(rng, nominal, plan.free)
    drive = P.ideal(nominal.machine, nominal.machine["inertia_kgm2"], control, nominal.period_s)
    build = Build(
        nominal,
        drive,
        plan,
        with_torque,
        bool(rng.random() < 0.3),
        str(rng.choice(("csv", "parquet", "parquet"))),
    )
    build.change("sensor", **random_sensor(rng, nominal, drive.sensor, not plan.free)._asdict())
    build.change("bridge", i_zone=0.01 * nominal.machine["rated_current_a"])
    omega_m = nominal.omega_rated / nominal.machine["pole_pairs"]
    build.change("shaft", w_sign=0.002 * omega_m, w_stribeck=0.05 * omega_m)
    return build
