# SPDX-License-Identifier: BSD-3-Clause
"""Rows at the current's or the power's limit are told: their values hold, but the drive was not free to follow.

At a limit a quantity stays at its largest value while the speed goes on; a step of a test plan stays at one speed, or
smaller values stay as well while the speed goes on.  The power may fall with a temperature that rises, as a protection
asks for.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.runs import runs_of_equal
from fluxproof.diagnosis.checks.torque_sign import current_of
from fluxproof.diagnosis.ground.quantities import ascii_of, counted, quantity
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
TOP = 0.99  # quantile that counts as the largest value
BAND = 0.015  # below and above it, in which a limited quantity stays: noise of the sensors
CROWDED = 4.0  # times as many rows as in the bands beside it
LEAST, LEAST_SHARE = 5, 0.02  # rows of a stretch; share of all rows at the limit
MOVES = 0.1  # of the largest speed: what it changes by within the longest stretch
LOADED = 0.3  # of rated current: below it nothing is limited
FAST, SMALL, MOST = 0.25, 0.1, 0.5  # of the fastest change of speed; of the largest value; share of rows that stay


def check(recording, nominal) -> None:
    i = current_of(recording)
    if recording.points or i is None or not recording.has("omega_e") or not recording.usable.any():
        return
    if _told(recording, np.abs(i), "current", "A", LOADED * nominal.machine.rated_current_a):
        return
    if recording.has("u_d_ref", "u_q_ref") and recording.slow:
        voltage = recording["u_d_ref"] + 1j * recording["u_q_ref"]
        _told(recording, 1.5 * np.abs(np.real(voltage * np.conj(i))), "power", "W", 0.0)


def _told(recording, size, name: str, unit: str, least: float) -> bool:
    """Note the rows in which a quantity (n,) is at a limit; whether there are any."""
    good = recording.usable & np.isfinite(size)
    top = _level(size[good])
    if top is None or top < least or not top:
        return False
    at = good & (np.abs(size / top - 1.0) <= BAND)
    first, length = runs_of_equal(at, LEAST)
    first, length = first[at[first]], length[at[first]]
    omega, t = recording["omega_e"], recording["t"]
    if length.sum() < LEAST_SHARE * len(size):
        return False
    stretches = [omega[a : a + n] for a, n in zip(first, length, strict=True)]
    if max(float(np.ptp(np.abs(x))) for x in stretches) <= MOVES * float(np.abs(omega).max()):
        return False
    if _planned(omega, size, top, at):
        return False
    longest = int(np.argmax(length))
    until = t[first[longest] + length[longest] - 1]
    more = f", and in {counted(len(first) - 1, 'other part')}," if len(first) > 1 else ""
    message = (
        f"from {t[first[longest]]:.6g} to {until:.6g} s{more} the {name} is at its limit, "
        f"{ascii_of(quantity(top, unit, 3))}: it stays there while the speed changes"
    )
    problem = Problem(f"{name}_limit", message, "", int(first[longest]), int(length.sum()), "rows used")
    recording.problems.append(problem)
    return True


def _planned(omega, size, top: float, at) -> bool:
    """Whether smaller values stay while the speed changes, too: then the plan asks for them, and for the largest."""
    moved, change = np.abs(omega[LEAST:] - omega[:-LEAST]), np.abs(size[LEAST:] - size[:-LEAST])
    free = (moved > FAST * moved.max()) & ~at[LEAST:] & ~at[:-LEAST] & (size[LEAST:] > SMALL * top)
    return bool(np.count_nonzero(free) >= LEAST and np.mean(change[free] <= BAND * top) > MOST)


def _level(size) -> float | None:
    """The value near the top of many equal ones (n,); None if it is reached in passing."""
    if len(size) < LEAST:
        return None
    top = float(np.quantile(size, TOP))
    if top <= 0.0:
        return None
    near = size[np.abs(size / top - 1.0) <= 2 * BAND]
    if not len(near):  # the quantile lies between two rows that are far apart
        return None
    top = float(np.median(near))
    share = size / top - 1.0
    inside = np.count_nonzero(np.abs(share) <= BAND)
    beside = np.count_nonzero((share < -BAND) & (share >= -3 * BAND)) + np.count_nonzero(share > BAND)
    return top if inside > CROWDED * max(beside / 2.0, 1.0) else None
