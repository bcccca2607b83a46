# SPDX-License-Identifier: BSD-3-Clause
"""A dq current or voltage that is written a few rows later than the others: found in the transients and realigned.

In a transient the voltage of an axis follows i, the step of i, omega times the other current and omega, whatever the
sizes of resistance and inductances, which are fitted.  The fit is best with the right rows side by side.  A column is
late only if it fits clearly better moved alone than both voltages moved together, which is a delay of the drive and
left to the diagnosis.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
COLUMNS = ("i_d", "i_q", "u_d_ref", "u_q_ref")
MOST = 6  # rows
CLEAR = 10.0  # factor on the product of the variances of both axes
STEP = 6.0  # times the usual step of the current: a transient
LEAST_STEP = 0.01  # of rated current
LEAST_ROWS, LEAST_STARTS = 60, 3  # of transients
MOST_ROWS = 20_000


def check(recording, nominal) -> None:
    if recording.slow or recording.points or recording.has("i_a", "i_b") or recording.has("d_a", "d_b", "d_c"):
        return
    if not recording.has(*COLUMNS, "omega_e") or len(recording) < 4 * MOST:
        return
    rows = _transients(recording, nominal)
    if rows is None:
        return
    columns = {name: recording[name] for name in (*COLUMNS, "omega_e")}
    delay = nominal.control.duty_applied_after_samples
    spread = lambda late: _spread(columns, rows, late, delay)  # noqa: E731
    together = min(spread({"u_d_ref": s, "u_q_ref": s}) for s in range(-MOST // 2, MOST // 2 + 1))
    alone = {(name, s): spread({name: s}) for name in COLUMNS for s in range(1, MOST + 1)}
    best = min(alone, key=alone.__getitem__)
    if alone[best] * CLEAR < together and best[1] < MOST:
        _realign(recording, *best)


def _transients(recording, nominal) -> np.ndarray | None:
    """Rows in and around steps of the current, MOST usable rows from any gap; None if there are too few."""
    change = np.hypot(np.diff(recording["i_d"], append=0.0), np.diff(recording["i_q"], append=0.0))
    good = recording.usable & np.append(recording.joined[:-1], False)
    far = 2 * MOST + 2
    whole = np.convolve(~good, np.ones(2 * far + 1), "same") < 0.5
    whole[:far] = whole[-far:] = False
    if not whole.any():
        return None
    least = max(STEP * float(np.median(change[whole])), LEAST_STEP * nominal.machine.rated_current_a)
    steps = (change > least) & whole
    near = np.convolve(steps, np.ones(2 * MOST + 1), "same") > 0.5
    rows = np.flatnonzero(near & whole)
    starts = np.count_nonzero(np.diff(rows) > 1) + 1
    if len(rows) < LEAST_ROWS or starts < LEAST_STARTS:
        return None
    return rows[:MOST_ROWS]


def _spread(columns, k, late, delay) -> float:
    """Product of the variances that the fits of both axes leave; late: {column: rows by which it is moved ahead}."""
    at = lambda name, rows: columns[name][rows + late.get(name, 0)]  # noqa: E731
    omega, product = 0.5 * (columns["omega_e"][k] + columns["omega_e"][k + 1]), 1.0
    for mine, other, voltage in (("i_d", "i_q", "u_d_ref"), ("i_q", "i_d", "u_q_ref")):
        first, second = at(mine, k), at(mine, k + 1)
        across = 0.5 * (at(other, k) + at(other, k + 1))
        a = np.stack([first + second, second - first, omega * across, omega, np.ones(len(k))], axis=1)
        scale = np.sqrt(np.mean(a**2, axis=0)) + 1e-30
        y = at(voltage, k - delay)
        c = np.linalg.lstsq(a / scale, y, rcond=None)[0]
        product *= float(np.var(y - a / scale @ c)) + 1e-30
    return product


def _realign(recording, name, rows) -> None:
    """Move a column ahead; the last rows before a gap have no value of their own and are not used."""
    x = recording[name]
    recording.columns[name] = np.append(x[rows:], np.full(rows, x[-1]))
    broken = np.flatnonzero(~recording.joined)
    for back in range(rows):
        recording.usable[np.maximum(broken - back, 0)] = False
    message = f"{name} is {counted(rows, 'row')} late against the other columns, as its transients show"
    recording.problems.append(Problem("late", message, name, 0, len(recording), "realigned"))
