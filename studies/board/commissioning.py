# SPDX-License-Identifier: BSD-3-Clause
"""Commissioning on random motors and on boards that are wired wrongly: what `make board` shows of it.

python -m studies.board.commissioning [COUNT]        a line a motor, then the figures
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fluxproof.commission.session import Refusal, Step
from fluxproof.commission.steps import commission
from fluxproof.fleet.engine import in_parallel
from studies.board.motors import CLASSES, Case, case

COUNT = 100
ACCEPTED = 0.98  # of sound motors
TARGETS = {  # error of an accepted motor: (largest, unit)
    "encoder angle": (3.0, "degrees electrical"),
    "current offset": (1.0, "LSB rms"),
    "R": (3.0, "%"),
    "L_d": (3.0, "%"),
    "L_q": (3.0, "%"),
    "psi": (1.0, "%"),
}
MEASURED = {  # keys of [machine] and their names among the steps' values
    "resistance_ohm": "resistance",
    "inductance_d_h": "inductance_d",
    "inductance_q_h": "inductance_q",
    "magnet_flux_wb": "magnet_flux",
    "inertia_kgm2": "inertia",
    "coulomb_friction_nm": "coulomb_friction",
    "viscous_friction_nms": "viscous_friction",
}


@dataclass
class Outcome:
    """One motor: errors by the names of TARGETS if accepted, the reason if refused; largest current over limit."""

    seed: int
    errors: dict[str, float]
    reason: str | None
    current: float
    direction_right: bool = True
    ratio: dict[str, float] | None = None  # error over stated uncertainty
    inertia: float = math.nan  # error, %

    @property
    def right(self) -> bool:
        return self.direction_right and all(self.errors[n] <= most for n, (most, _) in TARGETS.items())


def run(motor: Case) -> Outcome:
    """Commission one motor and compare with what it is."""
    bus = motor.bus()
    try:
        found, steps = commission(bus, motor.file)
    except Refusal as reason:
        return Outcome(motor.seed, {}, str(reason), bus.peak_a / motor.true.current_limit_a)
    return compare(motor, found, steps, bus.peak_a)


def compare(motor: Case, found, steps: list[Step], peak_a: float) -> Outcome:
    """Errors of an accepted commissioning."""
    m, n = motor.true.machine, found.machine
    angle = found.sensors.theta_offset_rad - motor.theta_offset_rad
    angle = (angle + math.pi) % (2.0 * math.pi) - math.pi
    percent = {
        "R": n.resistance_ohm / m.resistance_ohm,
        "L_d": n.inductance_d_h / m.inductance_d_h,
        "L_q": n.inductance_q_h / m.inductance_q_h,
        "psi": n.magnet_flux_wb / m.magnet_flux_wb,
    }
    offsets = np.array(found.sensors.current_offset_code) - motor.offset_codes
    errors = {name: 100.0 * abs(value - 1.0) for name, value in percent.items()}
    errors["encoder angle"] = abs(math.degrees(angle))
    errors["current offset"] = float(np.sqrt(np.mean(offsets**2)))
    values = {name: value for step in steps for name, value in step.values.items()}
    ratio = {key: (getattr(n, key) - getattr(m, key)) / values[name].sigma for key, name in MEASURED.items()}
    ratio["encoder angle"] = angle / values["theta_offset"].sigma
    return Outcome(
        motor.seed,
        errors,
        None,
        peak_a / motor.true.current_limit_a,
        found.sensors.position_reverse == (motor.board.sensors.position_direction < 0),
        ratio,
        100.0 * abs(n.inertia_kgm2 / m.inertia_kgm2 - 1.0),
    )


def stated(motor: Case, reverse: bool) -> Case:
    """The file states this direction of the encoder."""
    return replace(motor, file=replace(motor.file, sensors=replace(motor.file.sensors, position_reverse=reverse)))


def wrong_pairs(motor: Case) -> Case:
    """The file has one pole pair more."""
    machine = replace(motor.file.machine, pole_pairs=motor.file.machine.pole_pairs + 1)
    return replace(motor, file=replace(motor.file, machine=machine))


# name -> (changes of the board, change of the file, whether the file states a direction, what the reason must say)
FAULTS = {
    "open phase a": ({"open_leg": 0}, None, "phase a is open"),
    "open phase b": ({"open_leg": 1}, None, "phase b is open"),
    "open phase c": ({"open_leg": 2}, None, "phase c is open"),
    "current sensors b and c swapped": ({"sensed": (0, 2, 1)}, None, "phases are swapped"),
    "current sensors in a circle": ({"sensed": (1, 2, 0)}, None, "phases are swapped"),
    "current sensor b reversed": ({"polarity": (1.0, -1.0, 1.0)}, None, "current sensor b has the wrong sign"),
    "all current sensors reversed": ({"polarity": (-1.0, -1.0, -1.0)}, None, "a and b and c has the wrong sign"),
    "motor phases swapped": ({"legs": (0, 2, 1)}, "true direction", "reversed encoder"),
    "reversed encoder": ({}, "other direction", "reversed encoder"),
    "locked rotor": ({"locked": True}, None, "locked rotor"),
    "too little voltage": ({"u_dc": 0.5}, None, "too little voltage"),
    "no index": ({"has_index": False}, None, "no index"),
    "wrong pole pairs": ({}, "pole pairs", "pole_pairs"),
}


def refused(name: str, motor: Case) -> tuple[bool, str, float]:
    """(refused for the right reason, what was said, largest current over the limit) of one fault."""
    while name == "no index" and motor.true.encoder.kind != "abz":
        motor = case(motor.seed + len(CLASSES))
    changes, file, said = FAULTS[name]
    changes = dict(changes)
    if "u_dc" in changes:
        changes["u_dc"] *= motor.true.inverter.dc_bus_v
    reverse = motor.board.sensors.position_direction < 0
    given = {"true direction": reverse, "other direction": not reverse}.get(file)
    if given is not None:
        motor = stated(motor, given)
    if file == "pole pairs":
        motor = wrong_pairs(motor)
    bus = motor.bus(**changes)
    try:
        commission(bus, motor.file, given)
    except Refusal as reason:
        return said in str(reason), str(reason), bus.peak_a / motor.true.current_limit_a
    return False, "accepted", bus.peak_a / motor.true.current_limit_a


def row(figure: str, ours, target, unit: str, passed: bool) -> dict:
    return {"figure": figure, "ours": ours, "target": target, "unit": unit, "pass": bool(passed)}


def _motor(seed: int) -> Outcome:
    return run(case(seed))


def _faulty(job: tuple[str, int]) -> tuple[bool, str, float]:
    name, seed = job
    return refused(name, case(seed))


def figures(
    count: int = COUNT, faults_of: int = 3, say: Callable[[str], None] = lambda text: None, jobs: int | None = None
) -> list[dict]:
    """[{figure, ours, target, unit, pass}]: ``count`` motors, every fault on ``faults_of``; ``jobs`` at once."""
    by_seed, began = {}, time.monotonic()
    for seed, outcome in in_parallel(_motor, list(range(count)), jobs, "motors"):
        by_seed[seed] = outcome
        say(f"motor {seed}: {_line(outcome)} ({time.monotonic() - began:.0f} s)")
    wrong_boards, refusals = [(name, 1000 + n) for name in FAULTS for n in range(faults_of)], []
    for (name, seed), outcome in in_parallel(_faulty, wrong_boards, jobs, "faults"):
        ok, said, current = outcome
        refusals.append(outcome)
        verdict = "refused" if ok else "MISSED"
        say(f"{name}, motor {seed}: {verdict}: {said}; current {current:.2f} of the limit")
    return judged([by_seed[seed] for seed in range(count)], refusals)


def judged(outcomes: list[Outcome], refusals: list[tuple[bool, str, float]]) -> list[dict]:
    """The figures of motors and of wrong boards."""
    count = len(outcomes)
    accepted = [o for o in outcomes if o.reason is None]
    least = math.ceil(ACCEPTED * count)
    rows = [
        row("commissioning: motors accepted", len(accepted), f">= {least} of {count}", "motors", len(accepted) >= least)
    ]
    for name, (most, unit) in TARGETS.items():
        worst = max((o.errors[name] for o in accepted), default=math.nan)
        rows.append(row(f"commissioning: {name}, largest error", round(worst, 3), f"<= {most:g}", unit, worst <= most))
    wrong = sum(not o.right for o in accepted)
    rows.append(row("commissioning: accepted wrong results", wrong, "0", "motors", wrong == 0))
    inertia = max((o.inertia for o in accepted), default=math.nan)
    rows.append(row("commissioning: inertia, largest error", round(inertia, 2), "no target", "%", inertia == inertia))
    ratios = [abs(v) for o in accepted for v in o.ratio.values()]
    within = 100.0 * float(np.mean(np.array(ratios) <= 2.0)) if ratios else math.nan
    rows.append(row("commissioning: errors within two sigma", round(within, 1), "no target", "%", within == within))
    right, told = sum(ok for ok, *_ in refusals), len(refusals)
    rows.append(
        row("commissioning: faults refused with their reason", right, f"{told} of {told}", "runs", right == told)
    )
    most = max([o.current for o in outcomes] + [current for *_, current in refusals])
    rows.append(row("commissioning: largest current over the limit", round(most, 3), "<= 1", "1", most <= 1.0))
    return rows


def _line(o: Outcome) -> str:
    if o.reason is not None:
        return f"refused: {o.reason}; current {o.current:.2f}"
    shown = ", ".join(f"{name} {value:.2g}" for name, value in o.errors.items())
    return f"{'right' if o.right else 'WRONG'}: {shown}, J {o.inertia:.2g} %; current {o.current:.2f} of the limit"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.board.commissioning", description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=COUNT, help="random motors")
    parser.add_argument("--jobs", type=int, help="at once; one a core if not given")
    given = parser.parse_args()
    for line in figures(given.count, say=lambda text: print(text, flush=True), jobs=given.jobs):
        print(line)
