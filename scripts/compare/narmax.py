"""NARMAX selection: SysIdentPy's FROLS (error reduction ratio, order by BIC) on the misfit of the nominal drive.

The polynomial basis is of degree one because the candidates (dictionary.py) are already products; the model is
of finite impulse response (NFIR), as the balance of a row depends on that row alone.
"""

from __future__ import annotations

import warnings

import numpy as np

from scripts.compare.data import Data
from scripts.compare.dictionary import equations
from scripts.compare.naming import dominant, effects
from scripts.compare.sparse import Sparse

MOST_TERMS = 12
FIT_GRID = [{"rows": rows, "least_err": x} for rows in (5, 20) for x in (0.0, 1e-3, 1e-2, 5e-2)]
NAME_GRID = [{"least": x, "share": s} for x in (0.3, 0.6, 1.2, 2.5, 5.0) for s in (0.0, 0.15, 0.3, 0.5, 0.7)]


def fit(data: Data, rows: int, least_err: float) -> Sparse:
    """Select terms for every equation of the case; a term below the error reduction ratio ``least_err`` is left out."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    found, left = {}, {}
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
        for code, value, err in zip(model.final_model[:, 0], model.theta[:, 0], model.err, strict=False):
            if err < least_err:
                continue
            if code:
                c[used[int(code) // 1000 - 2]] = value
            else:
                constant = float(value)
        found |= {(e.name, e.terms[k]): (c[k] / e.scale[k], abs(c[k])) for k in np.flatnonzero(c)}
        if constant and e.name == "sum":
            found[e.name, "1"] = (constant, abs(constant))
        left[e.name] = e.y_blocks - e.blocks @ c - constant
    return Sparse(effects(data, found), (left["u_d"] + 1j * left["u_q"]) * data.units["u"])


def names(fitted: Sparse, least: float, share: float) -> list[str]:
    """Names of what dominates."""
    return dominant(fitted.sizes, least, share)
