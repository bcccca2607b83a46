# SPDX-License-Identifier: BSD-3-Clause
"""Rows at the voltage limit: the references ask for more than the bus can give, so that they are not at the machine.

An inverter gives at most u_dc / sqrt(3) without over-modulation.  A regulator that is not limited asks for more while
the current lags behind.  With over-modulation there is more, up to six-step, 6/pi/sqrt(3) = 1.10 times that; then
the fifth and seventh harmonic are at the machine too, and a row does not say how much of its reference was.  References
that lie beyond in most rows have another unit or scale, which other checks find.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.runs import mark, runs_of_equal
from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "channels"
BEYOND = 1.03  # of u_dc / sqrt(3): noise and gain of the bus sensor
BEYOND_NOMINAL = 1.2  # the same of a bus that was not recorded: a mains rectifier gives 10 % more than its rating
MOST = 0.5  # share of rows
SIX_STEP, WITHIN = 6.0 / np.pi / np.sqrt(3.0), 0.9  # of u_dc / sqrt(3), the same tolerance beyond; share of those rows
LEAST = 3  # rows that follow each other: fewer are spikes


def check(recording, nominal) -> None:
    if recording.points or not recording.has("u_d_ref", "u_q_ref") or recording.has("d_a", "d_b", "d_c"):
        return
    known = recording.has("u_dc")
    u_dc = recording["u_dc"] if known else float(nominal.inverter.dc_bus_v)
    size = np.hypot(recording["u_d_ref"], recording["u_q_ref"])
    beyond = size > (BEYOND if known else BEYOND_NOMINAL) / np.sqrt(3.0) * u_dc
    first, length = runs_of_equal(beyond, LEAST)
    first, length = first[beyond[first]], length[beyond[first]]
    if not len(first) or np.mean(beyond) > MOST:
        return
    # A row beside may be the mean of limited and unlimited periods.
    rows = mark(recording.usable, first, length, 1, 1)
    t = recording["t"]
    more = f" and in {counted(len(first) - 1, 'later part')}" if len(first) > 1 else ""
    most = np.broadcast_to(SIX_STEP * BEYOND / np.sqrt(3.0) * u_dc, size.shape)
    over = known and np.mean(size[beyond] <= most[beyond]) > WITHIN
    why = (
        "they are over-modulated, up to six-step, 1.10 times u_dc / sqrt(3), with harmonics that they lack"
        if over
        else "they ask for more than the bus gives, u_dc / sqrt(3)"
    )
    message = (
        f"from {t[first[0]]:.6g} to {t[first[0] + length[0] - 1]:.6g} s{more} the voltage references are at the limit: "
        f"{why}"
    )
    fatal = not recording.usable.any()
    recording.problems.append(
        Problem("voltage_limit", message, "", int(first[0]), rows, "" if fatal else "rows not used", fatal)
    )
