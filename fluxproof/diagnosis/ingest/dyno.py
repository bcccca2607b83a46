# SPDX-License-Identifier: BSD-3-Clause
"""Sheets of a dynamometer: torque, current and speed without the voltages of the control.

Only the torque is compared then,

    T_shaft = 3/2 p (psi + (L_d - L_q) i_d) i_q - friction(omega)

from which follow the magnet flux, friction and, with i_d, the reluctance; a gain of the current sensors leaves the same
torque as another flux.  The voltages of the nominal drive stand in for those that are missing, and no row of the
balance uses them (the recording lacks "voltage").  Without i_d it is taken to be zero.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ingest.demand import is_dyno

LACKS = frozenset({"voltage"})


def dq_of_dyno(columns: dict, nominal, notes: list) -> tuple[dict, frozenset]:
    """(columns with all dq values, what they lack) of a dyno sheet; the same columns and nothing of others."""
    if not is_dyno(columns):
        return columns, frozenset()
    i_d = columns.get("i_d")
    if i_d is None:
        i_d = np.zeros(len(columns["i_q"]))
        notes.append("i_d is not recorded and taken to be 0")
    u = steady_voltage(nominal.machine, i_d + 1j * columns["i_q"], columns["omega_e"])
    notes.append(
        "no voltage is recorded: only the torque is compared; resistance, inductances and inverter cannot be "
        "diagnosed. The control's u_q_ref would add R and separate flux and a scale of the currents, u_d_ref also "
        "inductances and the angle"
    )
    return columns | {"i_d": i_d, "u_d_ref": u.real, "u_q_ref": u.imag}, LACKS
