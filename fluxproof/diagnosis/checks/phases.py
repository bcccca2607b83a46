# SPDX-License-Identifier: BSD-3-Clause
"""Swapped phases, reversed sensors, wrong rotation direction: the interpretation that the nominal machine fits is used.

Every single change to the columns is tested with the nominal balance.  A change is accepted only if the recording does
not fit unchanged, fits with the change, and fits clearly worse with any other change, or with an angle that is merely
off: that is told and not corrected.  Mirrored interpretations (currents and duties both swapped, or the angle reversed)
are equivalent; the angle is then reversed.  Of dq values a change must fit at large currents too, and better than any
reading (conventions/).
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.balance import (
    BETTER,
    FIT,
    Rows,
    SteadyRows,
    contradicts,
    discriminates,
    misfit,
    rows_of,
)
from fluxproof.diagnosis.checks.rival_readings import CLEAR, best_reading, misfit_of, turned_misfit
from fluxproof.diagnosis.conventions.exchanges import CURRENTS, ORDERS, column_of, exchange, says
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "geometry"
SMALL = 0.03  # of the voltage: a smaller misfit is indistinguishable from noise
NOTHING = 0.8  # of the voltage: larger than any effect
D_CURRENT = 0.08  # of rated current: less does not tell the signs of single axes


def check(recording, nominal) -> None:
    rows = rows_of(recording, nominal)
    if rows is None or not discriminates(rows):
        return
    changes = _changes(rows)
    as_is = misfit(rows)
    at_current = as_is < FIT  # the voltage fits; it hardly depends on the currents, which may still be mistaken
    if at_current:
        as_is = misfit_of(rows, True)
        changes = {c: changed for c, changed in changes.items() if rows.steady or c[0] in ("currents", "sign")}
    if as_is < (SMALL if at_current else FIT):
        return
    # At large currents alone a change may fit that another operating point contradicts.
    # Where the currents make little of the voltage, its noise hides how much better a change is; they show it.
    for modes in ((False, True),) if at_current else ((False,), (False, True)):
        left = as_is if at_current else max(misfit_of(rows, mode) for mode in modes)
        tried = {name: max(misfit_of(changed, mode) for mode in modes) for name, changed in changes.items()}
        ranked = sorted(tried, key=tried.__getitem__)
        best = ranked[0]
        if fits := tried[best] <= min(BETTER * left, FIT) and not contradicts(rows, changes[best]):
            as_is = left
            break
    n = len(recording)
    if not fits:
        if as_is > NOTHING:
            message = (
                f"the nominal machine leaves {as_is:.0%} of the voltage unexplained: check drive.toml and the columns"
            )
            recording.problems.append(Problem("no_fit", message, "", 0, n, "the recording is used unchanged"))
        return
    second = next((says(name) for name in ranked[1:] if tried[name] < CLEAR * tried[best]), None)
    if isinstance(rows, SteadyRows):
        rival, reading = best_reading(rows, nominal, at_current)
        if CLEAR * rival < tried[best]:  # conventions/ tells it
            return
        second = second or (reading.says if rival < CLEAR * tried[best] else None)
    numbers = f"misfit {as_is:.0%} of the voltage as recorded, {tried[best]:.0%} with it"
    if second:
        message = f"{says(best)} or {second}: {numbers}; correct [columns] in drive.toml"
        recording.problems.append(Problem("swapped_phases", message, column_of(best), 0, n, fatal=True))
        return
    if turned_misfit(rows) < CLEAR * tried[best]:
        message = f"{says(best)}, or the angle is off: {numbers}"
        recording.problems.append(Problem("no_fit", message, column_of(best), 0, n, "the recording is used unchanged"))
        return
    ratio = angle_speed_ratio(recording, nominal.sample_time_s) if best[0] == "angle" else None
    exchange(recording.columns, best, ratio)
    code = {"angle": "rotation", "speed": "rotation", "sign": "sign"}.get(best[0], "swapped_phases")
    recording.problems.append(Problem(code, f"{says(best)}: {numbers}", column_of(best), 0, n, "corrected"))


def _changes(rows: Rows) -> dict[tuple, Rows]:
    """Every change that is tested, {change: changed rows}."""
    if isinstance(rows, SteadyRows):
        return _dq_changes(rows)
    changes: dict[tuple, Rows] = {("angle", ""): rows.change(theta=-rows.theta), ("sign", "i"): rows.change(i=-rows.i)}
    for name, order in ORDERS.items():
        changes["currents", name] = rows.with_currents(rows.i[..., order])
        changes["duties", name] = rows.change(d=rows.d[..., order])
        if name != "b and c":
            changes["both", name] = rows.with_currents(rows.i[..., order]).change(d=rows.d[..., order])
    for phase in range(3 if rows.third else 2):
        sign = np.where(np.arange(3) == phase, -1.0, 1.0)
        changes["sign", CURRENTS[phase]] = rows.with_currents(rows.i * sign)
    return changes


def _dq_changes(rows: SteadyRows) -> dict[tuple, Rows]:
    """The changes to dq values.  Without a d current the sign of one axis is that of both."""
    i, u = rows.dq, rows.u_dq
    changes: dict[tuple, Rows] = {
        ("speed", ""): rows.change(omega=-rows.omega),
        ("axes", "i_d i_q u_d_ref u_q_ref"): rows.change(dq=_swapped(i), u_dq=_swapped(u)),
        ("axes", "i_d i_q"): rows.change(dq=_swapped(i)),
        ("axes", "u_d_ref u_q_ref"): rows.change(u_dq=_swapped(u)),
        ("sign", "i_d i_q"): rows.change(dq=-i),
        ("sign", "u_d_ref u_q_ref"): rows.change(u_dq=-u),
        ("sign", "i_d u_d_ref"): rows.change(dq=-np.conj(i), u_dq=-np.conj(u)),
        ("sign", "u_q_ref"): rows.change(u_dq=np.conj(u)),
        ("exchanged", "i_q u_q_ref"): rows.change(dq=i.real + 1j * u.imag, u_dq=u.real + 1j * i[0].imag),
    }
    if np.percentile(np.abs(i.real), 75) > D_CURRENT * rows.machine.rated_current_a:
        changes["sign", "i_d"] = rows.change(dq=-np.conj(i))
        changes["sign", "i_q"] = rows.change(dq=np.conj(i))
        changes["sign", "u_d_ref"] = rows.change(u_dq=-np.conj(u))
    return changes


def _swapped(dq: Complex) -> Complex:
    return dq.imag + 1j * dq.real
