# SPDX-License-Identifier: BSD-3-Clause
"""What one operating point shows and what it cannot show: notes of an answer."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.decide.decision import OnePoint
from fluxproof.diagnosis.ground import constants as k


def one_point_notes(view, found: OnePoint, held) -> list[str]:
    """The notes on a SlowView of one operating point; held: (b,) bool, means that were not fitted."""
    i, omega = view.i.mean(), view.omega.mean()
    point = f"One operating point (omega_e = {omega:.4g} rad/s, i_d = {i.real:.3g} A, i_q = {i.imag:.3g} A)"
    notes = [
        f"{point} in {len(view)} means over {view.span_s:.4g} s, {int(held.sum())} of them held out: only changes "
        "over time can be diagnosed."
        if found.long
        else f"{point} with {len(view)} steady stretches; at least {k.LEAST_MEANS} with time stamps are needed to "
        "detect a drift."
    ]
    if np.isfinite(view.temp).all():
        notes.append(f"The winding temperature was recorded from {view.temp.min():.0f} to {view.temp.max():.0f} degC.")
    return [*notes, _of_constant(found)]


def _of_constant(found: OnePoint) -> str:
    if not found.off:
        return (
            "At the start the voltage agrees; errors of R, inductances, magnet flux, inverter loss and angle that "
            "cancel at this point cannot be detected."
        )
    c = found.constant
    return (
        f"At the start the voltage differs by {c.real:.3g} V on the d axis and {c.imag:.3g} V on the q axis; one point "
        "cannot show why: record more speeds and currents."
    )
