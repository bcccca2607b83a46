# SPDX-License-Identifier: BSD-3-Clause
"""Random cases: stratum, drive, plan and faults, determined by (seed, number, stratum, turn, attempt)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from studies.blind.sealed import plan as plans
from studies.blind.sealed import record
from studies.blind.sealed.drives import Drive, random_drive
from studies.blind.sealed.faults import FAULTS, UNKNOWN, Real

STRATA = {"healthy": 0.18, "single": 0.38, "pair": 0.17, "triple": 0.10, "unknown": 0.13, "ambiguous": 0.04}
# Without a torque transducer nobody can know these.
NEED_TORQUE = {"friction", "cogging", "current_scale", "udc_gain"}
# Only a change of the d current beside the q current shows these.
NEED_D = {"inductance_d", "saturation", "cross_saturation"}
# On a free shaft the torque column is the load, and the inertia hides a ripple.
NEED_BENCH = NEED_D | {"cogging"}
# One said in the words of the other: which of two is meant depends on a definition.
CLASHES = [
    {"current_gain", "current_scale"}, {"saturation", "inductance_d"}, {"saturation", "inductance_q"},
    {"cross_saturation", "inductance_d"}, {"cross_saturation", "inductance_q"}, {"delay", "sampling_skew"},
    {"dead_time", "emf_harmonics"},
]  # fmt: skip
# Where a recording holds one operating point (or one current), the mean voltages cannot tell these from each other.
AMBIGUOUS = [
    (plans.one_point, ("resistance", "magnet_flux"), ("resistance", "magnet_flux")),
    (plans.one_current, ("inductance_q", "saturation"), ("inductance_q", "saturation", "encoder_offset")),
]
PLANS = {"bench": plans.bench, "cycle": plans.cycle, "speed": plans.speed}
# A true value is given unless one of these makes it a matter of definition.
BLURRED = {
    "resistance": {"resistance_temperature", "phase_resistance_asymmetry"},
    "magnet_flux": {"magnet_temperature", "emf_harmonics"},
    "current_gain": {"current_scale"},
}


@dataclass
class Case:
    """A case before simulation.  effects: as in the truth file; kind: of the unknown physics; rivals: sets of names."""

    stratum: str
    drive: Drive
    plan: plans.Plan
    real: Real
    control: object
    effects: list[dict] = field(default_factory=list)
    kind: str = ""
    rivals: list[list[str]] = field(default_factory=list)
    torque: bool = False
    temperature: bool = False
    references: bool = False
    file_kind: str = "parquet"


def _names(rng, stratum, turn) -> list[str]:
    names = sorted(FAULTS)
    if stratum == "single":
        return [names[turn * 5 % len(names)]]
    count = {"pair": 2, "triple": 3}.get(stratum, 0)
    while True:
        chosen = [str(n) for n in rng.choice(names, count, replace=False)]
        if not any(clash <= set(chosen) for clash in CLASHES):
            return chosen


def _plan(rng, drive, names):
    chosen = set(names)
    if chosen & NEED_D:
        mode = "bench"
    elif chosen & NEED_BENCH:
        mode = str(rng.choice(("bench", "cycle")))
    else:
        mode = str(rng.choice(list(PLANS), p=(0.4, 0.3, 0.3)))
    turns = 3.0 if "encoder_eccentricity" in chosen else 0.0
    return PLANS[mode](rng, drive, turns)


def make(seed: int, number: int, stratum: str, turn: int, attempt: int = 0) -> Case:
    """The case of a seed; the same arguments give the same case."""
    rng = np.random.default_rng([seed, number, attempt, 53])
    rivals, names = [], _names(rng, stratum, turn)
    drive = random_drive(rng)
    if stratum == "ambiguous":
        planner, one_of, tied = AMBIGUOUS[turn % len(AMBIGUOUS)]
        names = [str(rng.choice(one_of))]
        rivals = [[n] for n in tied if n != names[0]]
        plan = planner(rng, drive)
    else:
        plan = _plan(rng, drive, names)
    bits = int(rng.integers(12, 17)) if stratum in ("unknown", "triple") else int(rng.integers(10, 17))
    real = record.healthy(rng, drive, plan, bits)
    control = record.controller(rng, drive, plan, slow=bool(set(names) & {"delay", "saturation"}))
    case = Case(stratum, drive, plan, real, control, rivals=rivals)
    for name in names:
        size = float(np.exp(rng.uniform(np.log(0.55), np.log(2.4))))
        known = FAULTS[name](real, drive, rng, size)
        if BLURRED.get(name, set()) & set(names):
            known = {}
        case.effects.append({"name": name, "form": "sealed", "size": size, "parameters": known})
    if stratum == "unknown":
        kinds = sorted(UNKNOWN)
        case.kind = kinds[turn % len(kinds)]
        UNKNOWN[case.kind](real, drive, rng, float(np.exp(rng.uniform(np.log(0.8), np.log(2.4)))))
    wanted = set(names)
    case.torque = bool(wanted & NEED_TORQUE) or bool(rng.random() < 0.25 and not rivals)
    case.temperature = "resistance_temperature" in wanted or bool(rng.random() < 0.2)
    case.references = bool(rng.random() < 0.4)
    case.file_kind = "csv" if rng.random() < 0.2 else "parquet"
    return case


def simulate(case: Case, seed: int, number: int, attempt: int = 0):
    """(all columns, inside, columns of the recording) of a case."""
    rng = np.random.default_rng([seed, number, attempt, 54])
    columns, inside = record.simulate(rng, case.drive, case.real, case.plan, case.control)
    kept = record.recorded(rng, case.drive, columns, case.plan.first, case.torque, case.temperature, case.references)
    return columns, inside, kept
