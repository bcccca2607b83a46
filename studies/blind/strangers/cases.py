# SPDX-License-Identifier: BSD-3-Clause
"""Random cases of a stranger: stratum, drive, plan and faults, determined by (seed, number, stratum, turn)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from studies.blind.strangers import rows
from studies.blind.strangers.drives import Drive, random_drive
from studies.blind.strangers.faults import FAULTS, UNKNOWN, Truth, truth_of
from studies.blind.strangers.sensors import Sensors

STRATA = {"healthy": 0.18, "single": 0.38, "pair": 0.18, "triple": 0.12, "unknown": 0.14}
# Only a torque transducer sees these.
NEED_TORQUE = {"friction", "cogging", "current_scale", "udc_gain"}
NEED_D_CURRENT = {"inductance_d", "saturation", "cross_saturation"}
# The same thing said twice: which of two is meant depends on a definition.
CLASHES = [
    {"current_gain", "current_scale"}, {"saturation", "inductance_d"}, {"saturation", "inductance_q"},
    {"cross_saturation", "inductance_d"}, {"cross_saturation", "inductance_q"}, {"delay", "sampling_skew"},
]  # fmt: skip
GENERATORS = {
    # simulator: faults that its parts cannot show
    "motulator": (set(), set()),
    "gem": (
        {"saturation", "cross_saturation", "iron_loss", "emf_harmonics", "cogging", "sampling_skew"},
        {"slotted_inductance"},
    ),
}


def parts(generator: str):
    """(plant, controller) of a simulator; imported here, as each needs a library of its own."""
    if generator == "motulator":
        from studies.blind.strangers.motulator import MotulatorControl, MotulatorPlant

        return MotulatorPlant, MotulatorControl
    from studies.blind.strangers.gem import GemPlant, PiControl

    return GemPlant, PiControl


@dataclass
class Case:
    """A case before simulation."""

    generator: str
    stratum: str
    drive: Drive
    truth: Truth
    plan: rows.Plan
    effects: list[dict] = field(default_factory=list)
    kind: str = ""


def _names(rng, generator, stratum, turn):
    names = sorted(set(FAULTS) - GENERATORS[generator][0])
    if stratum == "single":
        return [names[turn % len(names)]]
    count = {"pair": 2, "triple": 3}.get(stratum, 0)
    while True:
        chosen = [str(n) for n in rng.choice(names, count, replace=False)]
        if not any(clash <= set(chosen) for clash in CLASHES):
            return chosen


def _points(rng, drive):
    """Currents (i_d, i_q) of a grid, both signs of i_q and two levels of i_d."""
    a = 0.9 * drive.current
    high, low = rng.uniform(0.75, 1.0), rng.uniform(0.25, 0.45)
    side = rng.uniform(0.4, 0.7)
    points = [(0, high), (0, -high), (0, low), (-side, 0.1), (-side, 0.6), (-0.5 * side, -0.6), (0, -low)]
    return [(d * a, q * a) for d, q in points[: int(rng.integers(5, 8))]]


def _top_speed(drive, points):
    omega = 2 * np.pi * 0.07 / drive.period  # 14 samples a turn at least
    while max(drive.voltage(s * omega, d, q) for d, q in points for s in (1, -1)) > 0.42 * drive.bus:
        omega *= 0.97
    return omega


def _plan(rng, drive, names, stratum):
    points = _points(rng, drive)
    top = _top_speed(drive, points)
    # Of a free shaft the load is known, and its inertia hides a torque ripple.
    free = bool(rng.random() < 0.35) and not set(names) & (NEED_D_CURRENT | {"cogging"})
    if free:
        rated = 1.5 * drive.pole_pairs * drive.psi * drive.current
        speeds = rng.permutation([0.12, -0.15, 0.45, -0.5, 0.85, -0.8, 0.65][: int(rng.integers(5, 8))])
        held = [(s * top, 0.0, 0.0, load * rated) for s in speeds for load in rng.permutation([0.6, -0.5, 0.2, 0.0])]
        count = int(max(1100, 0.11 / drive.period))
    else:
        speeds = [0.07, -0.07, rng.uniform(0.35, 0.5), -rng.uniform(0.35, 0.5), rng.uniform(0.85, 1.0)]
        speeds += [-0.9][: int(rng.integers(0, 2))]
        rng.shuffle(speeds)
        held = [(s * top, d, q, 0.0) for s in speeds for d, q in rng.permutation(points)]
        count = int(max(800, 0.07 / drive.period))
    switching = "sampling_skew" in names or bool(rng.random() < 0.4)
    return rows.Plan(
        held, count, free,
        torque=bool(set(names) & NEED_TORQUE) or bool(rng.random() < 0.25),
        temperature="resistance_temperature" in names or bool(rng.random() < 0.25),
        switching=switching,
        current_bits=int(rng.integers(10, 17)) if stratum != "unknown" else 14,
        angle_bits=int(rng.integers(12, 19)),
        bandwidth=2 * np.pi * float(rng.uniform(80, 350)) if switching else 2 * np.pi * float(rng.uniform(80, 450)),
    )  # fmt: skip


def make(generator, seed, number, stratum, turn, attempt=0) -> Case:
    """The case of a seed; the same arguments give the same case."""
    rng = np.random.default_rng([seed, number, attempt, 31])
    drive = random_drive(rng)
    names = _names(rng, generator, stratum, turn)
    truth = truth_of(drive)
    plan = _plan(rng, drive, names, stratum)
    if generator == "gem":
        plan.switching = False  # its inverter's interlocking time is defined for averaged legs
    case = Case(generator, stratum, drive, truth, plan)
    for name in names:
        size = float(rng.uniform(0.6, 2.0))
        FAULTS[name](truth, drive, rng, size)
        case.effects.append({"name": name, "form": generator, "size": size, "parameters": {}})
    if stratum == "unknown":
        kinds = sorted(set(UNKNOWN) - GENERATORS[generator][1])
        case.kind = kinds[turn % len(kinds)]
        UNKNOWN[case.kind](truth, drive, rng, float(rng.uniform(0.8, 2.0)))
    return case


def columns_of(case, seed, number, attempt=0) -> dict:
    """The recording of a case."""
    rng = np.random.default_rng([seed, number, attempt, 32])
    return rows.record(*parts(case.generator), Sensors, case.drive, case.truth, case.plan, rng)
