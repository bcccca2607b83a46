# SPDX-License-Identifier: BSD-3-Clause
"""Which names have a size: one that is compatible with zero says nothing of the drive, whatever its probability.

Columns that are alike within a recording may share a misfit in any proportion: the set is then probable, and the size
of each of its effects is not known.
"""

from __future__ import annotations

import math

import numpy as np

from fluxproof.diagnosis.decide.estimates import named_effects
from fluxproof.diagnosis.effects import DOUBT
from fluxproof.diagnosis.ground.result import Estimate

VANISHES = 1e6  # times the value: a parameter that grows beyond all limits as its effect vanishes, as a resistance


def sizeless(names, posterior) -> set[str]:
    """Names of which every parameter is compatible with zero, its standard deviation that of the answer."""
    best, effects = posterior.best(), posterior.setup.effects
    nominal = best.problem.view.nominal
    return {
        e.name
        for e in named_effects(names, posterior, {})
        if not has_size(e.parameters, effects[e.name], best.c[e.name], nominal)
    }


def has_size(found: dict[str, Estimate], effect, c, nominal) -> bool:
    """Whether a parameter of an effect differs from what it is without the effect by more than its uncertainty.

    found: {parameter: Estimate}; c: {coefficient: value}, of which all are zero without it.
    """
    absent = effect.estimates(dict.fromkeys(c, 0.0), np.zeros((len(c),) * 2), nominal)
    return any(_differs(e, absent[key].value if key in absent else 0.0) for key, e in found.items())


def _differs(e: Estimate, absent: float) -> bool:
    if not (math.isfinite(e.value) and math.isfinite(e.sigma)):
        return False
    change = e.value if abs(absent) > VANISHES * abs(e.value) else e.value - absent
    return abs(change) > DOUBT * e.sigma
