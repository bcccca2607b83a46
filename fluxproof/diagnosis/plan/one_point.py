# SPDX-License-Identifier: BSD-3-Clause
"""The next recording after one operating point: no current, a lower speed, and another d-axis current."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.plan.bench_point import on_the_bench
from fluxproof.diagnosis.plan.planned import NO_CURRENT, OTHER_AXIS, OTHER_SPEED, Planned

LOWER_SPEED = 0.4  # of the recorded one
NO_D_CURRENT = 0.2  # of the rated one: up to this i_d another one is asked for, above it its opposite
ADDED = 0.5  # of the rated current


def points_beside(view, groups) -> tuple[Planned, ...]:
    """Points that separate the ambiguities of the only recorded one."""
    if not groups:
        return ()
    omega, i = float(view.omega.mean()), complex(view.i.mean())
    rated = view.machine.rated_current_a
    other = -np.conj(i) if abs(i.real) > NO_D_CURRENT * rated else i - ADDED * rated
    points = ((omega, 0j, NO_CURRENT), (LOWER_SPEED * omega, i, OTHER_SPEED), (omega, complex(other), OTHER_AXIS))
    names, bus = tuple(sorted({n for g in groups for n in g})), float(view.nominal.inverter.dc_bus_v)
    return tuple(Planned(*on_the_bench(w, complex(x), view.machine), names, why, bus) for w, x, why in points)
