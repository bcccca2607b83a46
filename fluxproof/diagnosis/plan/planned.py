# SPDX-License-Identifier: BSD-3-Clause
"""A planned operating point with the difference that it shows between explanations; words/ makes a Request of it."""

from __future__ import annotations

from dataclasses import dataclass

# What a further point changes, beside a recording of one operating point.
NO_CURRENT, OTHER_SPEED, OTHER_AXIS = "no_current", "other_speed", "other_axis"


@dataclass(frozen=True)
class Difference:
    """Voltage by which two sets of effects differ.

    order: electrical, 0: the mean; axis: 0 of d, 1 of q; size: [V], None if it is beyond the drive; only: the effects
    that only the first and only the second set contains.
    """

    order: float
    axis: int
    size: float | None
    only: tuple[tuple[str, ...], tuple[str, ...]]


@dataclass(frozen=True)
class Planned:
    """Electrical speed [rad/s] and current [A] of a point to record next, the effects that it separates, and why.

    temp_winding: [degC] of a machine that has cooled down; None: as it is.
    """

    omega_e: float
    i_dq: complex
    separates: tuple[str, ...]
    why: Difference | str
    u_dc: float
    temp_winding: float | None = None
