# SPDX-License-Identifier: BSD-3-Clause
"""What found effects change in the data: measurement errors are removed, the flux of the machine is added."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.effects.flux_effect import FluxEffect, LostFlux


def in_turn(view, effects, totals, show):
    """The view without measurement errors {effect: {coefficient: value}}, corrected one after the other.

    show: the view that decides in which blocks an effect can be seen.
    """
    for name in sorted(totals, key=lambda n: effects[n].corrected_last):
        view = view.kept_where(~show.shows(effects[name]), effects[name].corrected(view, totals[name]))
    return view


def with_flux(view, effects, c, **changed):
    """The view with the flux that magnetic effects of coefficients c add and that others, such as iron, remove."""
    magnetic = [n for n in sorted(c) if isinstance(effects[n], FluxEffect)]
    psi = sum((effects[n].psi(view, c[n]) for n in magnetic), np.zeros_like(view.i))
    more = np.array([effects[n].inductances(c[n], view.machine) for n in magnetic] or [(0.0, 0.0)]).sum(axis=0)
    least = -0.7 * np.array([view.machine.inductance_d_h, view.machine.inductance_q_h])
    view = view.replace(psi_extra=psi, delta_l=tuple(np.maximum(more, least)), **changed)
    lost = [effects[n].lost_flux(view, c[n]) for n in sorted(c) if isinstance(effects[n], LostFlux)]
    return view.replace(psi_extra=psi + sum(lost)) if lost else view
