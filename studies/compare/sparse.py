# SPDX-License-Identifier: BSD-3-Clause
"""Sparse regression: pySINDy's STLSQ on the misfit of the nominal drive (a discrepancy model).

The left-hand side is given (the balance does not use pySINDy's derivatives); averaged rows on both sides are its weak
form.  Sequentially thresholded least squares drops terms whose rms contribution is below ``threshold`` per mille of
bus, rated current or torque, and fits again.  ``ridge`` (times the rows) regularises the first fits with all terms;
the last fit is without it.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from studies.compare.data import Data
from studies.compare.dictionary import equations
from studies.compare.naming import NAME_GRID, dominant, effects

__all__ = ["FIT_GRID", "NAME_GRID", "Sparse", "fit", "names"]
FIT_GRID = [
    {"rows": rows, "threshold": x, "ridge": a}
    for rows in (20, 50)
    for x in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
    for a in (1e-6, 1e-3, 1e-2)
]


@dataclass
class Sparse:
    """sizes: {effect: rms per mille}; left: complex (b,) block means of u that remain [V]."""

    sizes: dict[str, float]
    left: np.ndarray


def fit(data: Data, rows: int, threshold: float, ridge: float) -> Sparse:
    """Select terms for every equation of the case."""
    import pysindy

    models, left = [], {}
    for e in equations(data, rows):
        optimizer = pysindy.STLSQ(threshold=threshold, alpha=ridge * len(e.y))
        model = pysindy.SINDy(optimizer=optimizer, feature_library=pysindy.IdentityLibrary())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns if no term remains, which is a valid answer here
            model.fit(e.x, t=1.0, x_dot=e.y[:, None], feature_names=e.terms)
        c = model.coefficients()[0]
        models.append((e, c))
        left[e.name] = e.y_blocks - e.blocks @ c
    return Sparse(effects(data, models), (left["u_d"] + 1j * left["u_q"]) * data.units["u"])


def names(fitted: Sparse, least: float, share: float, mechanical: float) -> list[str]:
    """Names of the dominant effects."""
    return dominant(fitted.sizes, least, share, mechanical)
