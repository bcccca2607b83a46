# SPDX-License-Identifier: BSD-3-Clause
"""What holds the picture: an event that has come to its place in the window, so that the rows before it are seen."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

NOTHING, GATES, REFERENCE = "nothing", "gates go off", "a reference moves"
LEVELS = ("i_d", "i_q", "speed", "torque", "u_dc")  # curves in SI units, speed in rpm
RISES, FALLS = " rises above", " falls below"
CHOICES = (NOTHING, GATES, REFERENCE, *(name + way for name in LEVELS for way in (RISES, FALLS)))
REFERENCES = ("omega_ref", "i_d_ref", "i_q_ext")


def events(what: str, level: float, fields: Mapping[str, np.ndarray], si: Mapping[str, np.ndarray]) -> np.ndarray:
    """The rows of the window at which ``what`` happens."""
    if what == NOTHING:
        return np.zeros(0, np.int64)
    if what == GATES:
        hit = np.diff(fields["run"]) < 0
    elif what == REFERENCE:
        hit = np.any([np.diff(fields[name]) != 0 for name in REFERENCES], axis=0)
    else:
        above = si[what.removesuffix(RISES).removesuffix(FALLS)] > level
        hit = above[1:] & ~above[:-1] if what.endswith(RISES) else above[:-1] & ~above[1:]
    return np.flatnonzero(hit) + 1


def holds(rows: np.ndarray, count: int, before: float, fresh: int) -> bool:
    """Whether an event has come to ``before`` of the window's ``count`` rows with the last ``fresh`` ones."""
    place = round(before * (count - 1))
    return bool(np.any((rows <= place) & (rows > place - max(fresh, 1))))
