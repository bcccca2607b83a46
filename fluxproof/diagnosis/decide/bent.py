# SPDX-License-Identifier: BSD-3-Clause
"""Which wrong constants are none: an inductance that changes with the current is a saturation.

A constant may have a curve beside it, of a share of what it adds, as no real machine follows a formula exactly.  Where
the curve is more than twice that share, the set says by another name that the constant changes.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.effects import DOUBT, FreeCurve
from fluxproof.diagnosis.effects.constant import Constant


def bent_groups(names, fit, effects) -> tuple[tuple[str, ...], ...]:
    """Ambiguities of the effects ``names`` whose curve is larger than its share with what they are then.

    fit: the best set; an effect that is in it has its own curve.
    """
    groups: dict[str, set[str]] = {}
    for n in names:
        other = effects[n].bent if isinstance(effects[n], Constant) else ""
        if other and other not in fit.names and n in fit.names and is_bent(fit, n):
            groups.setdefault(other, {other}).add(n)
    return tuple(tuple(sorted(group)) for group in groups.values())


def is_bent(fit, name) -> bool:
    """Whether the curve of an effect is more than twice the share of its formula that it may have."""
    problem = fit.problem
    effect = problem.setup.effects[name]
    parts = {True: 0.0, False: 0.0}
    for place in fit.places[name]:
        column = fit.take[place]
        free = problem.keys[column] in problem.cells.free
        parts[free] += fit.vector[place] * problem.p.x[:, column] / problem.p.level
    bent, straight = (float(np.linalg.norm(parts[free])) for free in (True, False))
    return isinstance(effect, FreeCurve) and bent > DOUBT * effect.curve * straight
