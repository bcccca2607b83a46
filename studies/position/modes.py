# SPDX-License-Identifier: BSD-3-Clause
"""Changes between torque, voltage, speed and position mode under load: the step of the voltage, docs/modes.md.

Each pair of modes is a run: speed mode at half speed against a load of half the rated torque, then the first mode, then
the second.  The references of both are what a host leaves that does not look: four fifths of the current, nine
tenths of the voltage and of the speed, a target far away.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping

import numpy as np

from fluxproof.cosim.runs import ClosedLoop
from golden_model import drive as drives
from golden_model.control.position_control import POSITION
from golden_model.motion import limits, to_position
from golden_model.registers import registers
from golden_model.units import TURN_RAD, from_si, to_si
from studies.position import figures
from studies.position.drives import moves, positioned

MODES = ("torque", "voltage", "speed", "position")
FIRST_S, CHANGE_S, END_S = 0.2, 0.25, 0.3
LOAD = 0.5  # of the rated torque
TARGET = 0.02  # of the circle
STEP_SAMPLES = 5  # from the change on, two more than position mode takes over in: later ones are a regulator's answer


def with_modes(drive, built: bool = True):
    """The drive with or without the blocks of voltage mode and of bumpless changes."""
    return dataclasses.replace(drive, core=dataclasses.replace(drive.core, modes=built))


def registers_of(mode: str) -> Mapping[str, int]:
    """The registers that choose a mode beside ``speed_mode``."""
    return {"position_mode": int(mode == "position"), "voltage_mode": int(mode == "voltage")}


def change(drive, before: str, after: str, rotates: bool = True):
    """(scenario, registers in place of the drive's, sample of the change).

    Without ``rotates`` the host leaves the rotational voltage of the d axis out: the current grows beyond its limit.
    """
    m, t_s = drive.machine, drive.sample_time_s
    speed = 0.5 * limits(drive)[0]
    first, at, n = (round(t / t_s) for t in (FIRST_S, CHANGE_S, END_S))
    modes = np.repeat(["speed", before, after], [first, at - first, n - at])
    current = LOAD * m.rated_current_a
    emf = speed * m.pole_pairs * m.magnet_flux_wb + m.resistance_ohm * current
    omega = from_si("omega_ref", speed * m.pole_pairs, drive)
    scenario = dataclasses.replace(
        moves(drive, n * t_s, {}),
        omega_m=speed,
        load=np.full(n, LOAD * 1.5 * m.pole_pairs * m.magnet_flux_wb * m.rated_current_a),
        speed_mode=(modes == "speed").astype(np.int64),
        omega_ref=np.where(np.arange(n) < first, omega, round(0.9 * omega)),
        i_q_ext=np.full(n, from_si("i_q_ext", 0.8 * current, drive)),
    )
    chosen = {0: registers_of("speed"), first: registers_of(before), at: registers_of(after)}
    target = {"position_target": POSITION.hi}
    scenario = dataclasses.replace(scenario, changes={k: {**v, **target} for k, v in chosen.items()})
    u_d = -speed * m.pole_pairs * m.inductance_q_h * current if rotates else 0.0
    values = {
        "u_d_ext": from_si("u_d", 0.9 * u_d, drive), "u_q_ext": from_si("u_q", 0.9 * emf, drive),
        "move_speed": round(speed * t_s / TURN_RAD * 2.0**34),
    }  # fmt: skip
    return scenario, values, at


def step_of(drive, observed: Mapping[str, np.ndarray], at: int) -> float:
    """Largest step of u_dq in the samples of a change, of the voltage circle.

    Without the compensation of the dead time, which steps six times a turn in every mode.
    """
    motor = {x: np.asarray(observed[f"u_{x}"]) - np.asarray(observed[f"u_comp_{x}"]) for x in "dq"}
    u = np.hypot(*(np.diff(to_si(f"u_{x}", of, drive)) for x, of in motor.items()))
    return float(u[at - 1 : at - 1 + STEP_SAMPLES].max()) * math.sqrt(3.0) / drive.inverter.dc_bus_v


def pairs() -> Iterator[tuple[str, str]]:
    """Every mode before every other."""
    return ((a, b) for a in MODES for b in MODES if a != b)


def rows_of(name: str, built: bool = True) -> Iterator[dict]:
    """The step at each change of a drive; without the blocks those between the modes that are there."""
    drive = with_modes(figures.case(name), built)
    for before, after in pairs():
        if not built and "voltage" in (before, after):
            continue
        scenario, values, at = change(drive, before, after)
        run = figures.play(drive, scenario, **values)
        assert not np.any(run.observed["sample_trip"])
        head = f"{name}, {'with' if built else 'without'} modes"
        what = f"step of the voltage, {before} to {after}, of the circle"
        yield figures.row(head, what, step_of(drive, run.observed, at), TARGET if built else math.inf, "1")


def every_change(carrier_half: int, periods: int, references: bool = False) -> ClosedLoop:
    """Every mode before every other in one run, the gates off in two of them: for the comparison with the RTL."""
    drive = with_modes(positioned("paper001"))
    drive = dataclasses.replace(drive, core=dataclasses.replace(drive.core, references=references))
    drive = drives.with_carrier(drive, carrier_half)
    tour = "torque voltage torque speed torque position voltage speed voltage position speed position torque".split()
    part = np.arange(periods) * len(tour) // periods
    begins = {int(np.argmax(part == k)): registers_of(mode) for k, mode in enumerate(tour)}
    aims = {"position_target": to_position(40.0), "u_d_ext": from_si("u_d", -20.0, drive)}
    aims["u_q_ext"] = from_si("u_q", 90.0, drive)
    scenario = dataclasses.replace(
        moves(drive, periods * drive.sample_time_s, {}),
        speed_mode=np.array([tour[k] == "speed" for k in part], np.int64),
        omega_ref=np.where(part % 2, from_si("omega_ref", 150.0, drive), from_si("omega_ref", -90.0, drive)),
        i_q_ext=np.where(part < 4, from_si("i_q_ext", 1.5, drive), from_si("i_q_ext", -2.5, drive)),
        enable=(~np.isin(part, (6, 9)) | (np.arange(periods) % 50 > 20)).astype(np.int64),
        changes={k: {**chosen, **aims} for k, chosen in begins.items()},
    )
    return ClosedLoop(drive, registers(drive), scenario)
