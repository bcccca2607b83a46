# SPDX-License-Identifier: BSD-3-Clause
"""Registry of the benchmark's effects: name, function and functional forms.

An effect is a function (build, rng, size, form) -> {parameter: true value}; ``size`` is a factor on a typical
size, 0.3 to 3.  Parameters are given only if the form defines them.
"""

from __future__ import annotations

import numpy as np

EFFECTS = {}
CATALOGUE = "catalogue"


def effect(*others):
    """Register an effect function under its name with the names of its other forms."""

    def register(function):
        EFFECTS[function.__name__] = (function, (CATALOGUE, *others))
        return function

    return register


def sign(rng, plus=0.5):
    """1 with the probability ``plus``, else -1."""
    return 1.0 if rng.random() < plus else -1.0


def rated(build):
    """Rated current [A] of the drive."""
    return build.nominal.machine["rated_current_a"]


def three(rng, other):
    """Three values with sum zero and largest value 1: one phase deviates, or (other) all of them."""
    if not other:
        return np.roll((1.0, -0.5, -0.5), rng.integers(3)) * sign(rng)
    x = rng.standard_normal(3)
    x -= x.mean()
    return x / np.abs(x).max()
