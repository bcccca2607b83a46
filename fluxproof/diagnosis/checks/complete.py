# SPDX-License-Identifier: BSD-3-Clause
"""Derive missing columns from others: speed from angle, a phase current from the other two, the bus voltage.

Columns of zeros (channels that were logged but not connected) count as missing.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import wrapped
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "complete"
SPEED_ROWS = 32  # over which the angle is differentiated: the resolution of an encoder is too coarse for one row


def check(recording, nominal) -> None:
    columns, notes = recording.columns, recording.meta["notes"]
    for name in ("i_c", "temp_winding", "torque"):
        if name in columns and not np.any(columns[name]) and _moves(recording):
            del columns[name]
            notes.append(f"{name} is zero throughout and treated as not recorded")
    if recording.has("i_a", "i_b", "i_c"):
        for name in ("i_a", "i_b"):
            _drop_dead(recording, name, nominal.machine.rated_current_a)
    for lost, other in (("i_a", ("i_b", "i_c")), ("i_b", ("i_a", "i_c"))):
        if lost not in columns and recording.has(*other):
            columns[lost] = -columns[other[0]] - columns[other[1]]
            del columns["i_c"]
            notes.append(f"{lost} is not recorded and is computed from the other two phase currents")
    if "u_dc" not in columns and recording.has("d_a", "d_b", "d_c"):
        columns["u_dc"] = np.full(len(recording), nominal.inverter.dc_bus_v)
        notes.append(f"u_dc is not recorded and is set to dc_bus_v = {nominal.inverter.dc_bus_v:g} V")
    if "omega_e" not in columns and "theta_e" in columns:
        columns["omega_e"] = speed_of(recording)
        notes.append(f"omega_e is not recorded and is computed from theta_e over {SPEED_ROWS} rows")
    if "theta_e" not in columns and "omega_e" in columns and not recording.points:
        step, omega = np.diff(recording["t"]), columns["omega_e"]
        columns["theta_e"] = wrapped(np.cumsum(np.append(0.0, 0.5 * (omega[1:] + omega[:-1]) * step)))
        notes.append("theta_e is not recorded and is integrated from omega_e: its zero is arbitrary")
        recording.meta["angle"] = "integrated"
        recording.lacks |= {"harmonics"}  # the integral drifts against the rotor


def _drop_dead(recording, name, rated) -> None:
    """Drop a phase current that is constant while the other two vary; it is computed from them."""
    others = [c for c in ("i_a", "i_b", "i_c") if c != name]
    columns = recording.columns
    if name not in columns or np.ptp(columns[name]) > 0 or not recording.has(*others):
        return
    if min(np.ptp(columns[other]) for other in others) > 0.1 * rated:
        message = f"constant at {columns[name][0]:.6g} throughout while the other currents vary"
        n = len(recording)
        recording.problems.append(Problem("stuck", message, name, 0, n, "computed from the other two"))
        del columns[name]


def speed_of(recording) -> np.ndarray:
    """(n,) electrical speed [rad/s]: mean slope of the angle over the neighbouring rows."""
    t = recording["t"]
    turned = np.cumsum(np.append(0.0, wrapped(np.diff(recording["theta_e"]))))
    rows = np.arange(len(t))
    first, last = np.maximum(rows - SPEED_ROWS // 2, 0), np.minimum(rows + SPEED_ROWS // 2, len(t) - 1)
    return (turned[last] - turned[first]) / np.maximum(t[last] - t[first], 1e-12)


def _moves(recording) -> bool:
    """Whether any current flows; in a recording of a drive at rest a column of zeros may be correct."""
    names = [name for name in ("i_a", "i_b", "i_d", "i_q") if name in recording.columns]
    return any(np.ptp(recording[name]) > 0 for name in names)
