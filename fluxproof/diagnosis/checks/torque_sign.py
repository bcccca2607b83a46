# SPDX-License-Identifier: BSD-3-Clause
"""A torque that is counted the other way: positive when the machine brakes, as a load's transducer may have it.

The air-gap torque of the nominal machine, 3/2 p (psi_d i_q - psi_q i_d), has a sign that no friction or inertia hides
under load.  The recorded one is reversed if it is like the opposite of it, and if the voltages confirm currents, angle
and speed: of an angle that is half a turn off, the currents would have the wrong sign.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.blocks import stator_current
from fluxproof.diagnosis.balance.shaft import airgap
from fluxproof.diagnosis.checks.balance import FIT, discriminates, misfit, rows_of
from fluxproof.diagnosis.ground.machine import airgap_torque
from fluxproof.diagnosis.ground.nominal import flux_level
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
LOADED = 0.05  # of rated torque: least rms of an air-gap torque whose sign is determined
ALIKE = 0.5  # of the air-gap torque: most that the opposite of a reversed torque differs from it, friction included


def check(recording, nominal) -> None:
    if not recording.has("torque", "omega_e"):
        return
    i = current_of(recording)
    if i is None:
        return
    driving, torque = airgap(nominal, i), recording["torque"]
    good = recording.usable & np.isfinite(torque) & np.isfinite(driving)
    rated = airgap_torque(nominal.machine, flux_level(nominal.machine), 1j * nominal.machine.rated_current_a)
    size = _rms(driving[good])
    if size < LOADED * rated or _rms((torque + driving)[good]) > ALIKE * size:
        return
    rows = rows_of(recording, nominal)
    if rows is None or not discriminates(rows) or misfit(rows) > 2 * FIT:
        return
    recording.columns["torque"] = -torque
    message = "torque is positive when the machine brakes"
    recording.problems.append(Problem("sign", message, "torque", 0, int(good.sum()), "corrected"))


def current_of(recording) -> np.ndarray | None:
    """(n,) dq current [A], or None."""
    if recording.has("i_d", "i_q"):
        return recording["i_d"] + 1j * recording["i_q"]
    if not recording.has("i_a", "i_b", "theta_e"):
        return None
    return stator_current(recording, None)[0] * np.exp(-1j * recording["theta_e"])


def _rms(x) -> float:
    return float(np.sqrt(np.mean(np.square(x)))) if len(x) else 0.0
