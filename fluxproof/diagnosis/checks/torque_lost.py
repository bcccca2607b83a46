# SPDX-License-Identifier: BSD-3-Clause
"""Rows in which a current flows and the shaft has no torque: the angle was lost, or the coupling slipped.

A control that has lost its angle drives its current along the magnets: the current stays at its limit, and a transducer
shows nearly nothing of the torque that it gives elsewhere in the recording.  In a log, the rotor's inertia takes
as much while the speed changes, so that only rows that are operating points count.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.shaft import airgap
from fluxproof.diagnosis.checks.torque_sign import current_of
from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
LOADED = 0.5  # of the largest air-gap torque: friction cannot take as much
LOST = 0.3  # of the usual torque at such a current
MOST = 0.2  # share of the loaded rows: with more, what is usual is not known


def check(recording, nominal) -> None:
    if not recording.points or not recording.has("torque", "omega_e") or (i := current_of(recording)) is None:
        return
    driving, torque = airgap(nominal, i), recording["torque"]
    good = recording.usable & np.isfinite(torque) & np.isfinite(driving)
    if not good.any():
        return
    loaded = good & (np.abs(driving) > LOADED * np.abs(driving[good]).max())
    share = np.where(loaded, torque / np.where(loaded, driving, 1.0), np.nan)
    usual = float(np.nanmedian(share))
    lost = loaded & (share / usual < LOST)
    if usual <= 0.0 or not lost.any() or lost.sum() > MOST * loaded.sum():
        return
    first, count = int(np.argmax(lost)), int(lost.sum())
    recording.usable &= ~lost
    message = (
        f"in {counted(count, 'row')} from row {first} on a current flows and the shaft has less than {LOST:.0%} of its "
        "usual torque: the angle was lost, or the coupling slipped"
    )
    recording.problems.append(Problem("torque_lost", message, "torque", first, count, "rows not used"))
