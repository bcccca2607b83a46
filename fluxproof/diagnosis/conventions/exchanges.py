# SPDX-License-Identifier: BSD-3-Clause
"""Columns in another order or with another sign than documented: phases, axes, angle, speed (checks/phases.py judges).

A change is a pair (what, which): ("currents", "b and c"), ("sign", "i_a"), ("angle", "").
"""

from __future__ import annotations

import numpy as np

EXACT = 1e-9  # of the currents: of their sum where one of them is computed from the other two
ORDERS = {
    "b and c": [0, 2, 1],
    "a and c": [2, 1, 0],
    "a and b": [1, 0, 2],
    "b, c, a": [1, 2, 0],
    "c, a, b": [2, 0, 1],
}
CURRENTS, DUTIES = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c")


def says(change) -> str:
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


def column_of(change) -> str:
    """A column to name in the finding."""
    what, which = change
    letters = [letter for letter in which.replace(",", " ").split() if letter in "abc"]
    if what in ("currents", "both"):
        return f"i_{letters[0]}"
    if what == "duties":
        return f"d_{letters[0]}"
    return {"angle": "theta_e", "speed": "omega_e"}.get(what) or ("i_a" if which == "i" else which.split()[0])


def exchange(columns, change, ratio=None) -> None:
    """Make the change in the columns; ratio: of the advance of the angle to the speed, if both tell it."""
    what, which = change
    if what in ("angle", "speed"):
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
            if a in columns and b in columns:
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
