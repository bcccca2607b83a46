# SPDX-License-Identifier: BSD-3-Clause
"""Gearing to a second encoder: error to the master, clutch at speed, phase after reversals, shifts of it, stops.

The master is a shaft of its own whose encoder has as many counts as this shaft's, or 4,000; its code comes with each
sample.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping

import numpy as np

from fluxproof.cosim.runs import ClosedLoop
from golden_model import drive as drives
from golden_model.control.position_control import POSITION
from golden_model.formats import TURN_W
from golden_model.motion import count_turns, gear_ratio, limits, to_position
from golden_model.registers import registers
from golden_model.units import TURN_RAD, to_si
from studies.position import figures, modes
from studies.position.drives import moves, positioned

COARSE = 4000  # counts a turn of the master
RATIO = (-3, 7)
START_S, RAMP_S = 0.05, 0.1
SOFT_SAMPLES = 128  # in which the acceleration of the shaft builds up: counts of the master are steps of its speed


def geared(drive, ratio: tuple[int, int] = RATIO, **position):
    """The drive with a gear of this ratio."""
    return dataclasses.replace(
        drive,
        core=dataclasses.replace(drive.core, gearing=True),
        position=dataclasses.replace(
            drive.position, gear_numerator=ratio[0], gear_denominator=ratio[1], gear_ramp_s=RAMP_S, **position
        ),
    )


def soft(name: str):
    """A geared drive of the study whose acceleration builds up in SOFT_SAMPLES."""
    plain = figures.case(name)
    jerk = 2.0 * limits(plain)[1] / (SOFT_SAMPLES * plain.sample_time_s)
    return geared(figures.case(name, jerk_rad_s3=jerk))


def codes(turns: np.ndarray, counts: int) -> np.ndarray:
    """Codes of the master's encoder of ``counts`` a turn at these angles [turns]."""
    counted = np.floor(turns * counts).astype(np.int64)
    return (counted * (1 << TURN_W) // counts) % (1 << TURN_W)


def with_master(scenario, turns: np.ndarray, counts: int):
    """The scenario with the master at these angles [turns], one for each sample."""
    changes = {k: dict(v) for k, v in scenario.changes.items()}
    for k, code in enumerate(codes(turns, counts)):
        changes.setdefault(k, {})["gear_code"] = int(code)
    return dataclasses.replace(scenario, changes=dict(sorted(changes.items())))


def turning(drive, seconds: float, speeds: Mapping[float, float], rise_s: float = 0.1) -> np.ndarray:
    """Angle of the master [turns] of every sample: ``speeds`` {time [s]: turns per second}, reached within rise_s."""
    t = np.arange(round(seconds / drive.sample_time_s)) * drive.sample_time_s
    times, values, last = [0.0], [0.0], 0.0
    for time, speed in speeds.items():
        times += [time, time + rise_s]
        values += [last, speed]
        last = speed
    return np.cumsum(np.interp(t, times, values)) * drive.sample_time_s


def error_to_master(drive, run, turns: np.ndarray, target: int = 0) -> np.ndarray:
    """The shaft beside the master's turns times the ratio [counts of its encoder], from the first sample on."""
    numerator, denominator = gear_ratio(drive)
    shaft = np.asarray(run.observed["shaft_position"]) - target
    return (shaft * POSITION.lsb - turns * numerator / denominator) / count_turns(drive)


def play(drive, scenario, turns: np.ndarray, counts: int | None = None):
    """The run of a scenario with a master; ``counts`` as fine as this shaft's encoder if none."""
    run = figures.play(drive, with_master(scenario, turns, counts or round(1.0 / count_turns(drive))))
    assert not np.any(run.observed["sample_trip"])
    return run


def master_speed(drive, share: float = 0.5) -> float:
    """Turns per second of the master at which the shaft has this share of its speed."""
    return share * limits(drive)[0] / TURN_RAD * RATIO[1] / abs(RATIO[0])


def following(name: str, drive, what: str, target: float, counts: int | None = None) -> Iterator[dict]:
    """Master from standstill to half speed, back the other way, to standstill; shift of the phase while it turns."""
    speed, seconds = master_speed(drive), 2.8
    turns = turning(drive, seconds, {0.1: speed, 0.9: -speed, 1.9: 0.0})
    shift = to_position(0.25 * TURN_RAD)
    scenario = moves(drive, seconds, {1.4: 0.25 * TURN_RAD}, {0.0: {"gear_on": 1}})
    run = play(drive, scenario, turns, counts)
    off = error_to_master(drive, run, turns)
    later = error_to_master(drive, run, turns, shift)

    def largest(errors, first, last):
        part = errors[round(first / drive.sample_time_s) : round(last / drive.sample_time_s)]
        return float(np.abs(part).max())

    head = f"{name}, gear, {what}"
    yield figures.row(head, "error to the master at constant speed, largest", largest(off, 0.7, 0.9), target, "counts")
    yield figures.row(head, "the same, phase shifted by a quarter turn", largest(later, 1.75, 1.9), target, "counts")
    yield figures.row(head, "error while the master accelerates", largest(off, 0.1, 0.2), math.inf, "counts")
    yield figures.row(head, "at rest after reversals", largest(later, 2.7, 2.8), target, "counts")


def clutch(name: str, drive) -> Iterator[dict]:
    """The gear engages at a master that turns at half speed: the largest step of the voltage, of the circle.

    Without the compensation of the dead time, as in modes.
    """
    on = 0.4
    turns = turning(drive, 1.0, {0.0: master_speed(drive)})
    run = play(drive, moves(drive, 1.0, {}, {on: {"gear_on": 1}}), turns)
    k, ramp = round(on / drive.sample_time_s), round(RAMP_S / drive.sample_time_s)
    assert run.observed["gear_engaged"][k + ramp + 1] and not run.observed["gear_engaged"][k + ramp - 2]
    motor = {x: run.observed[f"u_{x}"] - run.observed[f"u_comp_{x}"] for x in "dq"}
    u = np.hypot(*(np.diff(to_si(f"u_{x}", np.asarray(of), drive)) for x, of in motor.items()))
    u *= math.sqrt(3.0) / drive.inverter.dc_bus_v
    what = "step of the voltage while it engages at half speed, of the circle"
    yield figures.row(f"{name}, gear", what, float(u[k : k + ramp].max()), modes.TARGET, "1")
    what = "the same at constant speed behind it"
    yield figures.row(f"{name}, gear", what, float(u[k + 3 * ramp :].max()), math.inf, "1")


def at_a_stop(name: str) -> Iterator[dict]:
    """A master that leads beyond a soft end stop at half speed: how far the shaft goes, and where it rests."""
    drive = soft(name)
    drive = dataclasses.replace(
        drive, position=dataclasses.replace(drive.position, stop_low_rad=-6.0, stop_high_rad=6.0)
    )
    turns = turning(drive, 2.0, {0.05: master_speed(drive)})
    run = play(drive, moves(drive, 2.0, {}, {0.0: {"gear_on": 1}}), turns)
    angle = np.asarray(run.observed["shaft_position"]) * POSITION.lsb * TURN_RAD
    assert run.observed["gear_stopped"][-1]
    yield figures.row(f"{name}, gear", "way beyond a soft end stop", -6.0 - float(angle.min()), math.inf, "rad")
    rest = abs(float(angle[-1]) + 6.0) / TURN_RAD / count_turns(drive)
    yield figures.row(f"{name}, gear", "distance from the stop at the end", rest, 1.0, "counts")


def rows_of(name: str) -> Iterator[dict]:
    """All figures of a drive."""
    drive = soft(name)
    yield from following(name, drive, f"acceleration within {SOFT_SAMPLES} samples", 1.0)
    yield from following(name, geared(figures.case(name)), "trapezoid", 1.0)
    if count_turns(drive) * COARSE < 1.0:
        yield from following(name, drive, f"master of {COARSE:,} counts", math.inf, COARSE)
    yield from clutch(name, drive)
    yield from at_a_stop(name)


def every_clutch(carrier_half: int, periods: int) -> ClosedLoop:
    """Clutches, ratios, reversals, a stop, changes of mode and of the gates in one run: for comparison with the RTL."""
    drive = drives.with_carrier(
        geared(positioned("paper001", stop_low_rad=-30.0, stop_high_rad=12.0), ratio=(5, 3)), carrier_half
    )
    t_s = drive.sample_time_s
    turns = turning(drive, periods * t_s, {0.0: 12.0, 0.45 * periods * t_s: -9.0, 0.8 * periods * t_s: 15.0}, 50 * t_s)
    step = registers(drive).values.gear_step << 3
    begins: list[dict[str, int]] = [
        {"position_mode": 1, "use_stops": 0, "gear_step": step}, {"gear_on": 1}, {"position_target": to_position(2.0)},
        {"gear_numerator": -700, "gear_denominator": 1300}, {"position_mode": 0}, {"position_mode": 1}, {"gear_on": 0},
        {"gear_on": 1, "gear_numerator": 9, "gear_denominator": 4, "gear_step": 1000}, {"jerk_bits": 1},
        {"use_stops": 1, "position_target": to_position(8.0)}, {"gear_on": 0, "position_target": 0}, {"gear_on": 1},
    ]  # fmt: skip
    part = np.arange(periods) * len(begins) // periods
    scenario = dataclasses.replace(
        moves(drive, periods * t_s, {}),
        enable=((part != 6) | (np.arange(periods) % 50 > 20)).astype(np.int64),
        changes={int(np.argmax(part == k)): given for k, given in enumerate(begins)},
    )
    return ClosedLoop(drive, registers(drive), with_master(scenario, turns, COARSE))
