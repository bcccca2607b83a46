# SPDX-License-Identifier: BSD-3-Clause
"""Rows in which the current is reduced for the temperature are told: their values hold, but the drive was not free.

A protection lowers the current while the winding warms, until the heat that comes equals the heat that goes: current
and temperature reach their last values together.  Of a test plan that lowers the current, the winding cools afterwards,
or goes on warming at a current that stays.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.torque_sign import current_of
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
BLOCKS, LEAST_ROWS = 100, 4  # parts of the recording; rows of each
HIGH = 0.9  # quantile of a block that counts as its current: pauses do not lower it
LEAST_RISE_K, BAND_K, BAND = 10.0, 1.0, 0.05  # of the whole run; what stays within it or its share of the rise
STAYS = 10  # blocks at the last values
REDUCED, LOADED = 0.9, 0.3  # of the first current: at most this remains; of rated current
GRADUAL, NEAR = 3, 0.1  # blocks between first and last current; share of the reduction that counts as reached


def check(recording, nominal) -> None:
    i = current_of(recording)
    if i is None or "time" in recording.lacks or not recording.has("temp_winding"):
        return
    rows = np.flatnonzero(recording.usable & np.isfinite(np.abs(i)) & np.isfinite(recording["temp_winding"]))
    if len(rows) < BLOCKS * LEAST_ROWS:
        return
    blocks = np.array_split(rows, BLOCKS)
    temp = np.array([np.median(recording["temp_winding"][b]) for b in blocks])
    size = np.array([np.quantile(np.abs(i[b]), HIGH) for b in blocks])
    found = _reduced(temp, size, LOADED * nominal.machine.rated_current_a)
    if found is None:
        return
    first, last, before, after = found
    start, t = blocks[first][0], recording["t"]
    message = (
        f"from {t[start]:.6g} to {t[blocks[last][-1]]:.6g} s the current is reduced for the temperature, from "
        f"{quantity(before, 'A', 3)} to {quantity(after, 'A', 3)}, while temp_winding rises from "
        f"{quantity(temp[first], 'degC', 3)} to {quantity(temp[last], 'degC', 3)} and stays there"
    )
    count = sum(len(b) for b in blocks[first : last + 1])
    recording.problems.append(
        Problem("temperature_limit", ascii_of(message), "temp_winding", int(start), count, "rows used")
    )


def _reduced(temp, size, least: float) -> tuple[int, int, float, float] | None:
    """(first, last block, current before, after) of a reduction that ends as the temperature (BLOCKS,) stays."""
    rise, top = float(np.ptp(temp)), float(temp.max())
    band = max(BAND_K, BAND * rise)
    hot = np.flatnonzero(temp >= top - band)
    if rise < LEAST_RISE_K or len(hot) < STAYS or not hot[0] or np.ptp(hot) + 1 != len(hot):
        return None
    last = int(hot[-1])
    before = float(np.median(np.sort(size[: hot[-STAYS]])[-3:]))
    after = float(np.median(size[hot[-STAYS:]]))
    if after > REDUCED * before or after < least:
        return None
    span = before - after
    full = np.flatnonzero(size[:last] >= before - NEAR * span)
    reached = int(np.flatnonzero(size[full[-1] :] <= after + NEAR * span)[0] + full[-1])
    if reached - full[-1] <= GRADUAL or np.any(np.abs(size[reached : last + 1] - after) > 2 * NEAR * span):
        return None
    course = temp[full[-1] : reached + 1]
    if np.any(np.diff(course) < -band) or top - temp[reached] > max(BAND_K, NEAR * (top - temp[full[-1]])):
        return None
    cooled = temp[reached : last + 1].max() - temp[last]
    return None if cooled > BAND_K else (int(full[-1]), last, before, after)
