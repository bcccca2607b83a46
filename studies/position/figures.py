# SPDX-License-Identifier: BSD-3-Clause
"""The figures of docs/position.md: golden core on the switching plant, with the dead time of the drive file.

Each figure is a row {experiment, figure, ours, target, unit, pass}.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from fluxproof.cosim.golden_loop import simulate
from fluxproof.plant import Machine
from golden_model.control.position_control import ERROR, POSITION
from golden_model.motion import count_turns, limits
from golden_model.registers import registers
from golden_model.units import TURN_RAD, from_si, to_si
from studies.position.drives import moves, positioned

# Name of the drive -> (speed, acceleration) of the move, of what is ordinary for it: the small servo's bus of 24 V does
# not stand rated speed and rated torque together.
CASES = {"spindle_400v": (0.8, 1.0), "paper001": (0.8, 1.0), "servo_24v": (0.6, 1.0)}
START_S = 0.02


def row(experiment: str, figure: str, ours: float, target: float, unit: str) -> dict:
    """A figure; it passes where ours is not above the target."""
    return {"experiment": experiment, "figure": figure, "ours": ours, "target": target, "unit": unit,
            "pass": bool(ours <= target)}  # fmt: skip


def case(name: str, machine=None, **position):
    """A drive whose move has the speed and acceleration of CASES."""
    speed, acceleration, _ = limits(positioned(name))
    of_speed, of_acceleration = CASES[name]
    given = {"speed_rad_s": of_speed * speed, "acceleration_rad_s2": of_acceleration * acceleration}
    return positioned(name, machine, **(given | position))


def play(drive, scenario, plant=None, **values):
    """The run of a scenario; ``values``: registers in place of the drive's."""
    chosen = registers(drive)
    chosen = chosen._replace(values=chosen.values._replace(**values))
    plant = plant or Machine.from_mapping(vars(drive.machine))
    return simulate(drive, chosen, scenario, plant, dead_time_s=drive.inverter.dead_time_s)


def counts(drive, observed):
    """Following error in counts of the encoder."""
    return np.asarray(observed["position_error"]) * ERROR.lsb / count_turns(drive)


def there_and_back(drive):
    """(scenario, way [rad]): a move that reaches its speed for a quarter of its time, back again, a rest after each."""
    speed, acceleration, bits = limits(drive)
    way = speed * speed / acceleration * 4.0 / 3.0
    lasts = speed / acceleration + way / speed + (32 << bits) * drive.sample_time_s
    back = START_S + 1.5 * lasts
    return moves(drive, back + 1.5 * lasts, {START_S: way, back: 0.0}), way


def following(name: str) -> list[dict]:
    """The error on the way, with and without what is fed forward, with a wrong inertia, with limited jerk."""
    drive = case(name)
    scenario, way = there_and_back(drive)
    rows = []

    def told(what, drive=drive, target=math.inf, plant=None, **values):
        run = play(drive, there_and_back(drive)[0], plant, **values)
        off = counts(drive, run.observed)
        assert not np.any(run.observed["sample_trip"])
        rows.append(row(name, f"following error, {what}, largest", float(np.abs(off).max()), target, "counts"))
        return off

    off = told("trapezoid, right inertia", target=1.0)
    rows.append(row(name, "following error at the end of the move", abs(float(off[-1])), 1.0, "counts"))
    _, acceleration, _ = limits(drive)
    soft = case(name, jerk_rad_s3=acceleration / (40 * drive.sample_time_s))
    told("jerk limited", soft, 1.0)
    heavy = dataclasses.replace(
        Machine.from_mapping(vars(drive.machine)), inertia_kgm2=1.2 * drive.machine.inertia_kgm2
    )
    told("20 % more inertia than in the file", plant=heavy)
    told("nothing fed forward but the speed", k_inertia=0, k_viscous=0, coulomb=0)
    return rows


def at_rest(name: str) -> list[dict]:
    """Coulomb friction of 5 % of the rated torque that the file does not know: does the shaft come to rest?"""
    m = positioned(name).machine
    rated = 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a
    drive = case(name, {"coulomb_friction_nm": 0.05 * rated})
    scenario = moves(drive, 2.0, {START_S: 1.0, 0.5: 0.97, 1.0: 0.9701})
    rows = []
    for what, values in (("dead band of one count", {}), ("no dead band", {"position_band": 0})):
        run = play(drive, scenario, coulomb=0, **values)
        last = slice(len(scenario) * 3 // 4, None)
        code = np.asarray(run.observed["shaft_position"])[last]
        moved = int(np.ptp(code)) * POSITION.lsb / count_turns(drive)
        target = 0.0 if not values else math.inf
        rows.append(row(name, f"motion in the last half second at rest, {what}", moved, target, "counts"))
        off = float(np.abs(counts(drive, run.observed)[last]).max())
        rows.append(row(name, f"position error in it, {what}", off, 1.0 if not values else math.inf, "counts"))
    return rows


def between_modes(name: str) -> list[dict]:
    """The step of the voltage where position mode takes over at speed and gives back, beside that of any sample."""
    drive = case(name)
    speed = 0.5 * limits(drive)[0]
    t_s, change, back = drive.sample_time_s, 0.3, 0.5
    position, other = {"position_mode": 1, "position_target": POSITION.hi}, {"position_mode": 0}
    scenario = moves(drive, 0.6, {}, {0.0: other, change: position, back: other})
    reference = from_si("omega_ref", speed * drive.machine.pole_pairs, drive)
    ones = np.ones(len(scenario), np.int64)
    scenario = dataclasses.replace(scenario, speed_mode=ones, omega_ref=reference * ones)
    run = play(drive, scenario, move_speed=round(speed * t_s / TURN_RAD * 2.0**34))
    u = np.hypot(*(np.diff(to_si(f"u_{x}", np.asarray(run.observed[f"u_{x}"]), drive)) for x in "dq"))
    usual = float(u[round(0.25 / t_s) : round(change / t_s) - 2].max())
    rows = []
    for what, at in (("speed to position", change), ("position to speed", back)):
        k = round(at / t_s)
        step = float(u[k - 1 : k + 3].max())
        rows.append(
            row(name, f"step of the voltage, {what} at half speed, over the largest before", step / usual, 1.5, "1")
        )
    return rows


def stops(name: str) -> list[dict]:
    """A target beyond a soft end stop at full speed: how far beyond the stop the shaft goes."""
    drive = case(name, stop_low_rad=-1.0, stop_high_rad=2.0)
    run = play(drive, moves(drive, 1.0, {START_S: 100.0, 0.5: -100.0}))
    angle = np.asarray(run.observed["shaft_position"]) * POSITION.lsb * TURN_RAD
    beyond = max(float(angle.max()) - 2.0, -1.0 - float(angle.min()), 0.0) / TURN_RAD / count_turns(drive)
    return [row(name, "way beyond a soft end stop", beyond, 1.0, "counts")]


def all_figures():
    """Every figure, drive by drive."""
    for name in CASES:
        yield from following(name)
        yield from at_rest(name)
        yield from between_modes(name)
        yield from stops(name)
