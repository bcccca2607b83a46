# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a recording: effects of a logger, a cable or a wrong unit on healthy columns.

Each function changes the columns {name: (n,)} and returns the accepted problem codes.
"""

from __future__ import annotations

import numpy as np


def dropped_rows(columns, rng, nominal):
    n = len(columns["t"])
    keep = np.ones(n, bool)
    for _ in range(int(rng.integers(3, 12))):
        at = rng.integers(0, n - 400)
        keep[at : at + rng.integers(1, 300)] = False
    for name in columns:
        columns[name] = columns[name][keep]
    return ["gap", "drop", "missing"]


def duplicated_rows(columns, rng, nominal):
    n = len(columns["t"])
    twice = np.sort(np.append(np.arange(n), rng.integers(0, n, n // 200)))
    for name in columns:
        columns[name] = columns[name][twice]
    return ["duplicate", "repeat", "time"]


def stuck_column(columns, rng, nominal):
    name = str(rng.choice(("i_a", "i_b", "theta_e", "u_dc", "d_a")))
    at = int(rng.integers(0, len(columns["t"]) // 2))
    columns[name] = columns[name].copy()
    columns[name][at : at + len(columns["t"]) // 3] = columns[name][at]
    return ["stuck", "frozen", "constant", "current_sum"]


def swapped_phases(columns, rng, nominal):
    columns["i_b"], columns["i_c"] = columns["i_c"], columns["i_b"]
    return ["swap", "phase", "order", "reversed", "direction"]


def degrees(columns, rng, nominal):
    columns["theta_e"] = np.degrees(columns["theta_e"])
    return ["unit", "degree"]


def milliamperes(columns, rng, nominal):
    for name in ("i_a", "i_b", "i_c"):
        columns[name] = columns[name] * 1000.0
    return ["unit"]


def clipped_currents(columns, rng, nominal):
    most = 0.55 * nominal.machine["rated_current_a"]
    for name in ("i_a", "i_b", "i_c"):
        columns[name] = np.clip(columns[name], -most, most)
    return ["clip", "satur", "current_sum"]


def reversed_angle(columns, rng, nominal):
    columns["theta_e"] = (-columns["theta_e"]) % (2.0 * np.pi)
    return ["direction", "revers", "angle", "rotation", "speed"]


def percent_duties(columns, rng, nominal):
    for name in ("d_a", "d_b", "d_c"):
        columns[name] = columns[name] * 100.0
    return ["unit", "range", "duty"]


def missing_values(columns, rng, nominal):
    name = str(rng.choice(("i_a", "u_dc", "theta_e")))
    columns[name] = columns[name].copy()
    columns[name][rng.integers(0, len(columns["t"]), len(columns["t"]) // 50)] = np.nan
    return ["nan", "missing", "finite", "gap", "number"]


KINDS = {
    f.__name__: f
    for f in (
        dropped_rows,
        duplicated_rows,
        stuck_column,
        swapped_phases,
        degrees,
        milliamperes,
        clipped_currents,
        reversed_angle,
        percent_duties,
        missing_values,
    )
}
