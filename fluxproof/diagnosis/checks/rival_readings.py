# SPDX-License-Identifier: BSD-3-Clause
"""How well the nominal machine fits steady dq values that are read otherwise (conventions/; not itself a check).

A check must not correct what a reading explains as well: currents with the wrong sign are no frame that is turned.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.checks.balance import Rows, SteadyRows, misfit
from fluxproof.diagnosis.conventions.reading import Reading
from fluxproof.diagnosis.conventions.table import readings_for

TURNS = np.radians(np.arange(-60.0, 61.0, 5.0))  # by which the angle of a drive may be off
FINE = np.radians(np.arange(-4.0, 5.0))
CLEAR = 1.6  # least ratio of the misfits of the second best and the best hypothesis


def best_reading(rows: SteadyRows, nominal, at_current: bool = False) -> tuple[float, Reading]:
    """(misfit over voltage, reading) of the reading that fits steady rows best."""
    able = [r for r in readings_for(nominal) if r.dq is not False and r.bus == 1.0]
    tried = [misfit_of(as_read(rows, reading), at_current) for reading in able]
    best = int(np.argmin(tried))
    return tried[best], able[best]


def as_read(rows: SteadyRows, reading: Reading) -> SteadyRows:
    """Steady rows under a reading."""
    turn = np.exp(-1j * reading.turn)
    machine = replace(rows.machine, **{key: getattr(rows.machine, key) * f for key, f in reading.machine.items()})
    return rows.change(machine=machine, dq=rows.dq * turn * reading.currents, u_dq=rows.u_dq * turn * reading.volts)


def misfit_of(rows: Rows, at_current: bool = False) -> float:
    """The misfit, of steady rows also at large currents of each axis; infinite without an axis that is exchanged."""
    tried = [misfit(rows, at_current)]
    if rows.steady:
        tried += [misfit(rows, at_current=True), misfit(rows, at_d_current=True)]
    return max(tried) if np.isfinite(tried).all() else np.inf


def turned_misfit(rows: Rows) -> float:
    """The least misfit with an angle that is off by up to TURNS, as one point hardly tells from other changes."""
    coarse = min(TURNS, key=lambda turn: misfit(turned(rows, turn)))
    return min(misfit(turned(rows, turn)) for turn in coarse + FINE)


def turned(rows: Rows, turn: float) -> Rows:
    """The rows with an angle that was recorded ``turn`` [rad] ahead."""
    if isinstance(rows, SteadyRows):
        z = np.exp(1j * turn)
        return rows.change(dq=rows.dq * z, u_dq=rows.u_dq * z)
    return rows.change(theta=rows.theta - turn)
