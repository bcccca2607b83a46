# SPDX-License-Identifier: BSD-3-Clause
"""Over-modulation, docs/overmodulation.md: fundamental, distortion, torque gained, error and peak of the current.

Golden core on the switching plant with the dead time of the drive file, a torque beyond what exists, at speeds over the
base speed: without the blocks and with them at their default, and once with all of six-step that the table has.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterator

import numpy as np

from fluxproof.plant.transforms import linear_limit
from golden_model import torque_table
from golden_model.units import to_si
from studies.speed.drives import overmodulated
from studies.speed.figures import Case, base_speed, brusa, cases, play, possible, row, settled

SPEEDS = (1.2, 1.5, 2.0, 3.0, 4.0)  # over the base speed
SECONDS = 0.5
TO_THE_END = {"voltage_fundamental": 1.1015, "voltage_target": 1.0}


def built(case: Case, **control) -> Case:
    """The case with over-modulation; ``control``: keys of [control]."""
    return dataclasses.replace(case, drive=overmodulated(case.drive, **control))


def settled_run(case: Case, top: float, speed: float, seconds: float = SECONDS) -> dict[str, float]:
    """Means over the last quarter of a run that asks for 1.2 times the largest torque ``top``.

    torque [Nm]; of the circle u_dc/sqrt(3): fundamental, and harmonics of the voltage, both of the mean over a period;
    of the current limit: ripple of the current (rms of its vector), error of i_q (mean), peak; trips.
    """
    drive, n = case.drive, round(seconds / case.drive.sample_time_s)
    ramp = np.minimum(np.linspace(0.3, 1.7, n), 1.0) * speed
    run = play(case, np.full(n, 1.2 * top), ramp)
    seen, plant, last = run.observed, run.plant, slice(-(n // 4), None)
    u = to_si("u_applied_alpha", seen["u_applied_alpha"], drive)
    u = u + 1j * to_si("u_applied_beta", seen["u_applied_beta"], drive)
    angle = 2.0 * np.pi * seen["theta_me"] / 2**18 + 0.5 * ramp * drive.machine.pole_pairs * drive.sample_time_s
    turned = (u * np.exp(-1j * angle))[last] / linear_limit(drive.inverter.dc_bus_v)
    current, limit = plant["i_d"] + 1j * plant["i_q"], drive.current_limit_a
    wanted = to_si("i_q", seen["i_q_ref"], drive)
    return {
        "torque": settled(plant["torque"]),
        "fundamental": float(np.abs(turned.mean())),
        "harmonics": float(np.sqrt((np.abs(turned - turned.mean()) ** 2).mean()) / np.abs(turned.mean())),
        "ripple": float(np.sqrt((np.abs(current[last] - current[last].mean()) ** 2).mean()) / limit),
        "error": float(abs((wanted - plant["i_q"])[last].mean()) / limit),
        "peak": float(np.abs(current).max() / limit),
        "trips": float((seen["sample_trip"] != 0).any()),
    }


def gained(case: Case, plane: torque_table.Plane, speeds=SPEEDS) -> Iterator[dict]:
    """Rows of each speed: with the blocks, beside the same run without them."""
    base, top = base_speed(case, plane), plane.most(np.inf)[0]
    held = case.drive.bases.omega_me_rad_s * 1.98 / case.drive.machine.pole_pairs
    for times in (t for t in speeds if t * base <= held and possible(case, plane, t * base) >= 0.02 * top):
        name = f"over-modulation, {case.name}, {times:g} x base"
        without, found = (settled_run(c, top, times * base) for c in (case, built(case)))
        most = possible(case, plane, times * base)
        yield row(name, "torque, of what the circle allows", 100.0 * found["torque"] / most, 101.0, "%", True)
        yield row(name, "the same without", 100.0 * without["torque"] / most, 99.0, "%", True)
        yield row(name, "fundamental, of the circle", found["fundamental"], 1.06, "1", True)
        yield row(name, "harmonics of the voltage, of the fundamental", 100.0 * found["harmonics"], 31.1, "%")
        yield row(name, "ripple of the current, rms, of its limit", 100.0 * found["ripple"], 10.0, "%")
        yield row(name, "the same without", 100.0 * without["ripple"], 10.0, "%")
        yield row(name, "error of i_q, mean, of its limit", 100.0 * found["error"], 1.0, "%")
        yield row(name, "peak of the current, of its limit", found["peak"], 1.2, "1")
        yield row(name, "trips", found["trips"], 0, "1")


def to_the_end(case: Case, plane: torque_table.Plane, times: float = 2.0) -> Iterator[dict]:
    """The largest fundamental: all that the table has, at twice base speed."""
    name = f"six-step, {case.name}, {times:g} x base"
    found = settled_run(built(case, **TO_THE_END), plane.most(np.inf)[0], times * base_speed(case, plane))
    yield row(name, "fundamental, of the circle", found["fundamental"], 1.10, "1", True)
    yield row(name, "harmonics of the voltage, of the fundamental", 100.0 * found["harmonics"], 31.1, "%")
    yield row(name, "error of i_q, mean, of its limit", 100.0 * found["error"], 1.0, "%")
    yield row(name, "peak of the current, of its limit", found["peak"], 1.2, "1")
    yield row(name, "trips", found["trips"], 0, "1")


def main() -> int:
    """These rows alone, for the cases whose name begins with an argument; all without one."""
    chosen = [c for c in cases(brusa()) if not sys.argv[1:] or c.name.startswith(tuple(sys.argv[1:]))]
    missed = 0
    for case in chosen:
        plane = torque_table.Plane(case.truth, case.drive.machine.pole_pairs, case.drive.current_limit_a)
        for r in (*gained(case, plane), *to_the_end(case, plane)):
            print(
                f"{'' if r['pass'] else 'MISS':5}{r['experiment']:46} {r['figure']:46} {r['ours']:>9g} {r['unit']}",
                flush=True,
            )
            missed += not r["pass"]
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
