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
from fluxproof.diagnosis.checks.balance import BETTER, EXACT, FIT, Rows, SteadyRows, discriminates, misfit, rows_of
from fluxproof.diagnosis.checks.rival_readings import CLEAR, best_reading, misfit_of, turned_misfit
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "geometry"
SMALL = 0.03  # of the voltage: a smaller misfit is indistinguishable from noise
NOTHING = 0.8  # of the voltage: larger than any effect
D_CURRENT = 0.08  # of rated current: less does not tell the signs of single axes

ORDERS = {
    "b and c": [0, 2, 1],
    "a and c": [2, 1, 0],
    "a and b": [1, 0, 2],
    "b, c, a": [1, 2, 0],
    "c, a, b": [2, 0, 1],
}
CURRENTS, DUTIES = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c")


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
    modes = (False, True) if at_current else (False,)
    tried = {name: max(misfit_of(changed, mode) for mode in modes) for name, changed in changes.items()}
    ranked = sorted(tried, key=tried.__getitem__)
    best = ranked[0]
    n = len(recording)
    if tried[best] > BETTER * as_is or tried[best] > FIT:
        if as_is > NOTHING:
            message = (
                f"the nominal machine leaves {as_is:.0%} of the voltage unexplained: check drive.toml and the columns"
            )
            recording.problems.append(Problem("no_fit", message, "", 0, n, "the recording is used unchanged"))
        return
    second = next((_words(name) for name in ranked[1:] if tried[name] < CLEAR * tried[best]), None)
    if isinstance(rows, SteadyRows):
        rival, reading = best_reading(rows, nominal, at_current)
        if CLEAR * rival < tried[best]:  # conventions/ tells it
            return
        second = second or (reading.says if rival < CLEAR * tried[best] else None)
    numbers = f"misfit {as_is:.0%} of the voltage as recorded, {tried[best]:.0%} with it"
    if second:
        message = f"{_words(best)} or {second}: {numbers}; correct [columns] in drive.toml"
        recording.problems.append(Problem("swapped_phases", message, _column(best), 0, n, fatal=True))
        return
    if turned_misfit(rows) < CLEAR * tried[best]:
        message = f"{_words(best)}, or the angle is off: {numbers}"
        recording.problems.append(Problem("no_fit", message, _column(best), 0, n, "the recording is used unchanged"))
        return
    _apply(recording, best, nominal.sample_time_s)
    code = {"angle": "rotation", "speed": "rotation", "sign": "sign"}.get(best[0], "swapped_phases")
    recording.problems.append(Problem(code, f"{_words(best)}: {numbers}", _column(best), 0, n, "corrected"))


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


def _words(change) -> str:
    """A change in words."""
    what, which = change
    if what == "angle":
        return "the angle rotates against the phase sequence of currents and duties"
    if what == "speed":
        return "the speed has the wrong sign, or i_q and u_q_ref have"
    names = which.split()
    if what == "axes":
        return "the d and q axes are swapped" if len(names) == 4 else f"{' and '.join(names)} are swapped"
    if what == "exchanged":
        return f"{' and '.join(names)} are swapped"
    if what == "sign":
        if which == "i":
            return "the phase currents have the opposite sign"
        return f"{' and '.join(names)} ha{'ve' if names[1:] else 's'} the opposite sign"
    who = {"currents": "phase currents", "duties": "duties", "both": "phase currents and duties"}[what]
    return f"{who} {which} are swapped" if " and " in which else f"{who} are in the order {which}"


def _column(change) -> str:
    """A column to name in the finding."""
    what, which = change
    letters = [letter for letter in which.replace(",", " ").split() if letter in "abc"]
    if what in ("currents", "both"):
        return f"i_{letters[0]}"
    if what == "duties":
        return f"d_{letters[0]}"
    return {"angle": "theta_e", "speed": "omega_e"}.get(what) or ("i_a" if which == "i" else which.split()[0])


def _apply(recording, change, period) -> None:
    """Make the change in the recording."""
    what, which = change
    columns = recording.columns
    if what in ("angle", "speed"):
        ratio = angle_speed_ratio(recording, period) if what == "angle" else None
        if "theta_e" in columns:
            columns["theta_e"] = -columns["theta_e"]
        if ratio is None or ratio > 0.0:  # a speed with the opposite sign of the angle was right
            columns["omega_e"] = -columns["omega_e"]
            if "torque" in columns:
                columns["torque"] = -columns["torque"]
    elif what == "exchanged":
        a, b = which.split()
        columns[a], columns[b] = columns[b], columns[a]
    elif what == "axes":
        for a, b in zip(*[iter(_with_references(which))] * 2, strict=True):
            if recording.has(a, b):
                columns[a], columns[b] = columns[b], columns[a]
    elif what == "sign":
        _negate(columns, which)
    else:
        if "i_c" not in columns and what != "duties":
            columns["i_c"] = -columns["i_a"] - columns["i_b"]
        for names in (CURRENTS, DUTIES) if what == "both" else (CURRENTS,) if what == "currents" else (DUTIES,):
            values = [columns[names[k]] for k in ORDERS[which]]
            columns.update(zip(names, values, strict=True))


def _negate(columns, which) -> None:
    """Reverse the sign of columns in place; a third current that follows from the other two follows them."""
    third = columns.get("i_c") if which in CURRENTS[:2] else None
    derived = third is not None and np.allclose(columns["i_a"] + columns["i_b"], -third, 0.0, EXACT * np.ptp(third))
    for name in (*CURRENTS, "i_d", "i_q") if which == "i" else _with_references(which):
        if name in columns:
            columns[name] = -columns[name]
    if derived:
        columns["i_c"] = -columns["i_a"] - columns["i_b"]


def _with_references(which) -> list[str]:
    """The columns of a change to dq values, with the references of its currents."""
    names = which.split()
    return names + [f"{name}_ref" for name in names if name in ("i_d", "i_q")]
