# SPDX-License-Identifier: BSD-3-Clause
"""Which rows the balance of a recording uses, and what it cannot show: notes of an answer."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.holdout import FEW
from fluxproof.diagnosis.balance.slow_view import SlowView
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.words.phrases import capital


def balance_notes(view, held, effects, ambiguity) -> list[str]:
    """The notes on a view; held: (b,) bool, held-out blocks; effects: those that the view shows."""
    if isinstance(view, SlowView):
        torque = bool(np.isfinite(view.torque).any())
        return [*_of_points(view, held), *(_separated(effects[n], torque) for group in ambiguity for n in group)]
    rows, out = view.u_dc.shape[1], int(held.sum())
    notes = [f"The voltage balance uses {len(view)} steady blocks of {rows} rows; {out} of them were held out."]
    if not np.isfinite(view.torque).any():
        notes.append(_without_torque(view.machine))
    return notes


def _without_torque(machine) -> str:
    """Why the torque was not compared, and what would make it comparable."""
    if not machine.inertia_kgm2:
        why = "it is not recorded, and the drive file has no inertia_kgm2 to compute it from the acceleration"
    else:
        why = "it is not recorded, and no fast torque change shows that the shaft turns freely"
    return f"The torque was not compared, so friction and cogging torque were not assessed: {why}."


def _of_points(view, held) -> list[str]:
    """Operating points: how many, and what they cannot show."""
    points, i = len(np.unique(view.run)), view.i.mean(axis=1)
    unseen = [name for name, effect in CATALOGUE.items() if not view.shows(effect).any()]
    notes = [
        f"The voltage balance uses {len(view)} steady stretches at {points} operating points; "
        f"{int(held.sum())} of the stretches were held out.",
        f"Operating points contain neither harmonics nor sampling instants, so these effects cannot be diagnosed: "
        f"{', '.join(unseen)}.",
    ]
    if not view.d_known.all():
        notes.append("u_d is not recorded: only the q axis was compared.")
    if points < FEW:
        notes.append(
            f"With {points} operating points every fourth stretch instead of every fourth point was held out: record "
            "more points."
        )
    if not i.real.any():
        notes.append("No d-axis current was recorded: L_d and the saturation of the d axis cannot be diagnosed.")
    if len({x > 0 for x in np.sign(view.omega[:, 0]) if x}) < 2:
        notes.append(
            "Only one direction of rotation was recorded; encoder offset and inverter loss are distinguished only by "
            "load and speed."
        )
    return notes


def _separated(effect, torque) -> str:
    return f"{capital(effect.title)} is separated from similar effects by: {effect.experiment(torque)}."
