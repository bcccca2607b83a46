# SPDX-License-Identifier: BSD-3-Clause
"""LASSO: scikit-learn's path of least angles on the misfit of the nominal drive, the penalty chosen by BIC.

The candidates are those of pySINDy and SysIdentPy (dictionary.py).  The coefficients of the terms that remain are
fitted again without the penalty, which would shrink them.
"""

from __future__ import annotations

import warnings

import numpy as np

from studies.compare.data import Data
from studies.compare.dictionary import equations
from studies.compare.naming import NAME_GRID, dominant, effects
from studies.compare.sparse import Sparse

__all__ = ["FIT_GRID", "NAME_GRID", "fit", "names"]
FIT_GRID = [{"rows": rows, "most": most} for rows in (20, 50) for most in (8, 16, 32)]


def fit(data: Data, rows: int, most: int) -> Sparse:
    """Select terms for every equation of the case; most: steps along the path."""
    from sklearn.linear_model import LassoLarsIC

    models, left = [], {}
    for e in equations(data, rows):
        used = np.flatnonzero(np.isfinite(e.scale))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # collinear candidates, which it drops
            found = LassoLarsIC(criterion="bic", fit_intercept=False, max_iter=most).fit(e.x[:, used], e.y)
        kept = used[np.flatnonzero(found.coef_)]
        c = np.zeros(len(e.terms))
        if len(kept):
            c[kept] = np.linalg.lstsq(e.x[:, kept], e.y, rcond=None)[0]
        models.append((e, c))
        left[e.name] = e.y_blocks - e.blocks @ c
    return Sparse(effects(data, models), (left["u_d"] + 1j * left["u_q"]) * data.units["u"])


def names(fitted: Sparse, least: float, share: float, mechanical: float) -> list[str]:
    """Names of the dominant effects."""
    return dominant(fitted.sizes, least, share, mechanical)
