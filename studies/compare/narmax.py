# SPDX-License-Identifier: BSD-3-Clause
"""NARMAX selection: SysIdentPy's FROLS (error reduction ratio, order by BIC) on the misfit of the nominal drive.

The polynomial basis is of degree one because the candidates (dictionary.py) are already products; the model is
of finite impulse response (NFIR), as the balance of a row depends on that row alone.
"""

from __future__ import annotations

import warnings

import numpy as np

from studies.compare.data import Data
from studies.compare.dictionary import equations
from studies.compare.naming import NAME_GRID, dominant, effects
from studies.compare.sparse import Sparse

MOST_TERMS = 12
__all__ = ["FIT_GRID", "NAME_GRID", "fit", "names"]
FIT_GRID = [{"rows": rows} for rows in (5, 20, 50)]


def fit(data: Data, rows: int) -> Sparse:
    """Select terms for every equation of the case."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    models, left = [], {}
    for e in equations(data, rows):
        used = np.flatnonzero(np.isfinite(e.scale))
        model = FROLS(
            order_selection=True,
            n_info_values=min(MOST_TERMS, len(used)),
            info_criteria="bic",
            model_type="NFIR",
            basis_function=Polynomial(degree=1),
            estimator=LeastSquares(),
            xlag=[[1]] * len(used),
            ylag=1,
        )
        ahead = np.roll(e.x[:, used], -1, axis=0)  # the package's regressors are x(k-1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model.fit(X=ahead, y=e.y[:, None])
        c = np.zeros(len(e.terms))
        constant = 0.0
        # Regressor codes: 0 is the constant, 2001 is x1(k-1), 3001 is x2(k-1), ...
        for code, value in zip(model.final_model[:, 0], model.theta[:, 0], strict=True):
            if code:
                c[used[int(code) // 1000 - 2]] = value
            else:
                constant = float(value)
        if "1" in e.terms:  # the package has a constant of its own
            c[e.terms.index("1")] += constant
            constant = 0.0
        models.append((e, c))
        left[e.name] = e.y_blocks - e.blocks @ c - constant
    return Sparse(effects(data, models), (left["u_d"] + 1j * left["u_q"]) * data.units["u"])


def names(fitted: Sparse, least: float, share: float, mechanical: float) -> list[str]:
    """Names of the dominant effects."""
    return dominant(fitted.sizes, least, share, mechanical)
