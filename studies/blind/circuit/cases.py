# SPDX-License-Identifier: BSD-3-Clause
"""Random cases: stratum, drive, plan and faults, determined by (seed, number, stratum, turn, attempt)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from studies.blind.circuit import plan as plans
from studies.blind.circuit import record
from studies.blind.circuit.drives import Drive, Real, random_real, sheet
from studies.blind.circuit.faults import FAULTS, LATER, MADE, NAMES, SHEET, UNKNOWN

STRATA = {"healthy": 0.18, "single": 0.42, "pair": 0.18, "unknown": 0.22}
# Without a torque transducer a wrong bus voltage is a wrong machine.
NEED_TORQUE = {"udc_gain"}
# The same thing said twice: which of two is meant depends on a definition.
CLASHES = [
    {"saturation", "inductance_d"}, {"saturation", "inductance_q"}, {"encoder_offset", "angle_late"},
    {"dead_time", "emf_harmonics"},
]  # fmt: skip
# A true value is given unless the other makes it a matter of definition.
BLURRED = {
    "resistance": {"resistance_temperature", "phase_resistance_asymmetry"},
    "magnet_flux": {"magnet_temperature", "emf_harmonics"},
}


@dataclass
class Case:
    """A case before simulation.  effects: as in the truth file; kind: of the unknown physics."""

    stratum: str
    drive: Drive
    real: Real
    plan: plans.Plan
    effects: list[dict] = field(default_factory=list)
    kind: str = ""
    torque: bool = False
    temperature: bool = False


def _faults(rng, stratum, turn) -> list[str]:
    names = sorted(set(FAULTS) - {"iron_teeth"})  # which is two effects
    if stratum == "single":
        return [names[turn * 5 % len(names)]]
    if stratum != "pair":
        return []
    if turn % 4 == 3:
        return ["iron_teeth"]
    while True:
        chosen = [str(n) for n in rng.choice(names, 2, replace=False)]
        if not any(clash <= set(chosen) for clash in CLASHES):
            return chosen


def _size(rng) -> float:
    return float(np.exp(rng.uniform(np.log(0.6), np.log(2.0))))


def make(seed: int, number: int, stratum: str, turn: int, attempt: int = 0) -> Case:
    """The case of a seed; the same arguments give the same case."""
    rng = np.random.default_rng([seed, number, attempt, 71])
    names = _faults(rng, stratum, turn)
    sizes = {name: _size(rng) for name in names}
    kind, real = random_real(rng)
    for name in MADE:
        if name in sizes:
            MADE[name](real, rng, sizes[name])
    drive = sheet(kind, real)
    plan = plans.bench(rng, drive)
    for name in LATER:
        if name in sizes:
            LATER[name](real, rng, sizes[name])
    known = {}
    for name in SHEET:
        if name in sizes:
            drive, known[name] = SHEET[name](drive, rng, sizes[name])
    case = Case(stratum, drive, real, plan)
    for name in names:
        parameters = {} if BLURRED.get(name, set()) & set(names) else known.get(name, {})
        for effect in NAMES.get(name, (name,)):
            case.effects.append({"name": effect, "form": "circuit", "size": sizes[name], "parameters": parameters})
    if stratum == "unknown":
        case.kind = sorted(UNKNOWN)[turn % len(UNKNOWN)]
        UNKNOWN[case.kind](real, rng, _size(rng))
    case.torque = bool(NEED_TORQUE & set(names)) or bool(rng.random() < 0.3)
    case.temperature = "resistance_temperature" in names or bool(rng.random() < 0.25)
    return case


def simulate(case: Case, seed: int, number: int, attempt: int = 0):
    """(inside, columns of the recording) of a case."""
    rng = np.random.default_rng([seed, number, attempt, 72])
    simulated = record.simulate(rng, case.drive, case.real, case.plan)
    return simulated[1], record.columns(rng, case.drive, case.real, simulated, case.torque, case.temperature)
