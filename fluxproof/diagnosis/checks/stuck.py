# SPDX-License-Identifier: BSD-3-Clause
"""Stuck channels: constant while other channels show that they must change.

A constant value alone is no fault: a supply is constant, and so is every signal of a simulated drive at rest.  A phase
current is stuck if the angle advances and another current changes; an angle if the speed shows rotation; a speed if
the rate of the angle changes; a dq current if its reference changes, or if the other one differs from row to row while
the operating point changes; a duty if the angle advances by a whole turn and
the other duties change.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio, wrapped
from fluxproof.diagnosis.checks.runs import mark, runs_of_equal
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "channels"
LEAST_STUCK = 50  # rows
MOST_RUNS = 2000
CURRENT = 0.1  # of rated current: what counts as a change
DUTY = 0.03
LIVE = 0.5  # share of rows in which a channel that is not stuck differs from the row before
MOVED = 0.2  # of a channel's largest value: another operating point
SPEED = ("omega_e",)


def check(recording, nominal) -> None:
    if recording.slow:
        return
    rated = nominal.machine.rated_current_a
    turned, by_angle = _turned(recording, nominal.sample_time_s)
    ratio = angle_speed_ratio(recording, nominal.sample_time_s) or 1.0  # a speed of another unit is not stuck
    tests = {
        "theta_e": lambda a, b: abs(turned[b] - turned[a]) > 0.5,
        "omega_e": lambda a, b: _speed_left(recording, by_angle, a, b, nominal.sample_time_s * ratio),
    }
    for name in ("i_a", "i_b", "i_c"):
        others = [c for c in ("i_a", "i_b", "i_c") if c != name and c in recording.columns]
        tests[name] = lambda a, b, o=others: (
            max(abs(turned[b] - turned[a]), abs(by_angle[b] - by_angle[a])) > 1.0
            and _change(recording, o, a, b) > CURRENT * rated
        )
    for name in ("i_d", "i_q"):
        tests[name] = lambda a, b, n=name: (
            _change(recording, [f"{n}_ref"], a, b) > 2 * CURRENT * rated or _others_live(recording, n, a, b, rated)
        )
    for name in ("d_a", "d_b", "d_c"):
        others = [c for c in ("d_a", "d_b", "d_c") if c != name]
        tests[name] = lambda a, b, o=others: (
            abs(by_angle[b] - by_angle[a]) > 2 * np.pi and _change(recording, o, a, b) > DUTY
        )
    for name, moved in tests.items():
        if name in recording.columns:
            _check_one(recording, name, moved)


def _check_one(recording, name, moved) -> None:
    first, length = runs_of_equal(recording[name], LEAST_STUCK)
    if not len(first):
        return
    longest = np.argsort(-length, kind="stable")[:MOST_RUNS]
    # A clipped channel is constant too; its rows are already excluded.
    fresh = [k for k in longest if recording.usable[first[k] + length[k] // 2]]
    stuck = sorted(k for k in fresh if moved(first[k], first[k] + length[k] - 1))
    if not stuck:
        return
    first, length = first[stuck], length[stuck]
    rows = mark(recording.usable, first, length, 1, 1)
    fatal = rows > 0.9 * len(recording)
    value = recording[name][first[0]]
    recording.problems.append(
        Problem("stuck", f"constant at {value:.6g} for {rows} rows while others change", name, int(first[0]), rows,
                "" if fatal else "rows not used", fatal)
    )  # fmt: skip


def _turned(recording, period) -> tuple[np.ndarray, np.ndarray]:
    """((n,), (n,)) rotation since the first row [rad], from the speed and from the angle; zeros without either."""
    n = len(recording)
    by_speed = recording["omega_e"] * period if "omega_e" in recording.columns else np.zeros(n)
    by_angle = by_speed
    if "theta_e" in recording.columns:
        theta = recording["theta_e"]
        # Across a gap the step of the angle is undefined.
        by_angle = np.where(recording.joined, wrapped(np.diff(theta, append=theta[-1])), by_speed)
    return np.cumsum(by_speed), np.cumsum(by_angle)


def _speed_left(recording, by_angle, a, b, period) -> bool:
    """Whether the rate of the angle differs between the halves of the run and from the constant speed."""
    if "theta_e" not in recording.columns or b - a < LEAST_STUCK:
        return False
    middle = (a + b) // 2
    first, second = (
        (by_angle[middle] - by_angle[a]) / (middle - a),
        (by_angle[b] - by_angle[middle]) / (b - middle),
    )
    speed = recording["omega_e"][a] * period
    return bool(max(abs(first - speed), abs(second - speed)) * (b - a) > 3.0 and abs(first - second) * (b - a) > 1.0)


def _others_live(recording, name, a, b, rated) -> bool:
    """Whether the other dq current differs from row to row, and current, speed or voltage change over the run."""
    other, rows = {"i_d": "i_q", "i_q": "i_d"}[name], slice(a, b + 1)
    whole = b - a + 1 >= len(recording)  # a constant that was never measured
    if whole or other not in recording.columns or np.mean(np.diff(recording[other][rows]) != 0.0) < LIVE:
        return False
    voltages = [c for c in ("u_d_ref", "u_q_ref", "d_a", "d_b", "d_c") if c in recording.columns]
    moved = [_change(recording, [c], a, b) > MOVED * np.max(np.abs(recording[c])) for c in (*voltages, *SPEED)
             if c in recording.columns]  # fmt: skip
    return _change(recording, [other], a, b) > 2 * CURRENT * rated or sum(moved) >= 2


def _change(recording, names, a, b) -> float:
    """The largest range of the named channels over the rows a to b."""
    return max(
        (float(np.ptp(recording[name][a : b + 1])) for name in names if name in recording.columns),
        default=0.0,
    )
