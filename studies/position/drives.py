# SPDX-License-Identifier: BSD-3-Clause
"""Drives and scenes of the study: moves of a free shaft."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.runs import ClosedLoop
from golden_model import drive as drives
from golden_model.motion import to_position
from golden_model.registers import registers
from golden_model.units import from_si


def positioned(name: str, machine: Mapping | None = None, **position):
    """The drive of docs/drives with a position loop; ``machine``, ``position``: keys in place of the file's."""
    drive = drives.load(DRIVES / f"{name}.toml")
    return dataclasses.replace(
        drive,
        core=dataclasses.replace(drive.core, position_loop=True),
        machine=dataclasses.replace(drive.machine, **(machine or {})),
        position=dataclasses.replace(drive.position, **position),
    )


def moves(drive, seconds: float, targets: Mapping[float, float], changes: Mapping[float, Mapping] | None = None):
    """Position mode from the start: ``targets`` {time [s]: angle of the shaft [rad]}; ``changes`` {time: registers}."""
    n, t_s = round(seconds / drive.sample_time_s), drive.sample_time_s
    zeros = np.zeros((4, n), np.int64)  # an array each: a scene may be written into
    found: dict[int, dict[str, int]] = {0: {"position_mode": 1}}
    for time, angle in targets.items():
        found.setdefault(round(time / t_s), {})["position_target"] = to_position(angle)
    for time, given in (changes or {}).items():
        found.setdefault(round(time / t_s), {}).update(given)
    return Scenario(
        omega_ref=zeros[0], load=np.zeros(n), u_dc=np.full(n, drive.inverter.dc_bus_v), i_d_ref=zeros[1],
        i_q_ext=zeros[2], speed_mode=zeros[3], enable=np.ones(n, np.int64), changes=dict(sorted(found.items())),
    )  # fmt: skip


def all_modes(carrier_half: int, periods: int) -> ClosedLoop:
    """Torque, speed and position mode in turn, moves that change on the way, stops, a stop of the gates."""
    drive = drives.with_carrier(positioned("paper001", stop_low_rad=-3.0, stop_high_rad=9.0), carrier_half)
    k = np.arange(periods) * 10 // periods
    base = moves(drive, periods * drive.sample_time_s, {})
    at = {part: round(part * periods / 10) for part in range(10)}
    to = {part: {"position_target": to_position(angle)} for part, angle in ((4, 5.0), (5, -20.0), (6, 8.0), (9, 0.0))}
    changes = {at[part]: given for part, given in to.items()}
    changes[at[0]] = {"position_mode": 0}
    changes[at[2]] = {"position_mode": 1, "jerk_bits": 1}
    changes[at[7]] = {"position_mode": 0}
    changes[at[8]] = {"position_mode": 1}
    scenario = dataclasses.replace(
        base,
        speed_mode=np.isin(k, (1, 2, 7)).astype(np.int64),
        omega_ref=np.where(k == 7, from_si("omega_ref", -200.0, drive), from_si("omega_ref", 150.0, drive)),
        i_q_ext=np.full(periods, from_si("i_q_ext", 1.5, drive)),
        enable=((k != 3) | (np.arange(periods) % 50 > 20)).astype(np.int64),
        changes=dict(sorted(changes.items())),
    )
    return ClosedLoop(drive, registers(drive), scenario)
