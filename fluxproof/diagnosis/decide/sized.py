# SPDX-License-Identifier: BSD-3-Clause
"""Which sets and names have a size: one that is compatible with zero says nothing of the drive, however probable it is.

Columns that are alike within a recording may share a misfit in any proportion.  A set in which an effect is smaller
than its own uncertainty says no more than the sets without that effect, which are judged too: it is no explanation,
neither for a name nor for an alternative.  The size of a name may be open only because a rival takes its place in other
sets: there the name is not present, so that it is an ambiguity with the rival (names.py).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.decide.estimates import estimates_in
from fluxproof.diagnosis.effects import DOUBT
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Estimate

VANISHES = 1e6  # times the value: a parameter that grows beyond all limits as its effect vanishes, as a resistance
FAINT = 15.0  # log evidence below the best set from which on a set has no weight, so that it is not asked


def with_sizes(posterior):
    """The posterior over the sets of which every effect is larger than its own standard deviation."""
    fits, best = {}, -math.inf
    for fit in sorted(posterior.fits.values(), key=lambda f: -f.value):
        if fit.value < best - FAINT or all(is_sized(fit, n, k.SIZED) for n in fit.names):
            fits[fit.names] = fit
            best = max(best, fit.value)
    return replace(posterior, fits=fits)


def is_sized(fit, name, sigmas=DOUBT) -> bool:
    """Whether an effect has a size in a set (see ``has_size``)."""
    effect, nominal = fit.problem.setup.effects[name], fit.problem.view.nominal
    return has_size(estimates_in(fit, name), effect, fit.c[name], nominal, sigmas)


def has_size(found: dict[str, Estimate], effect, c, nominal, sigmas=DOUBT) -> bool:
    """Whether a parameter of an effect differs from what it is without the effect by more than its uncertainty.

    found: {parameter: Estimate}; c: {coefficient: value}, of which all are zero without it; sigmas: standard deviations
    that it must differ by.
    """
    absent = effect.estimates(dict.fromkeys(c, 0.0), np.zeros((len(c),) * 2), nominal)
    return any(_differs(e, absent[key].value if key in absent else 0.0, sigmas) for key, e in found.items())


def _differs(e: Estimate, absent: float, sigmas) -> bool:
    if not (math.isfinite(e.value) and math.isfinite(e.sigma)):
        return False
    change = e.value if abs(absent) > VANISHES * abs(e.value) else e.value - absent
    return abs(change) > sigmas * e.sigma
