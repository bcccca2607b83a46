"""Sparse regression: pySINDy's STLSQ on the misfit of the nominal drive (a discrepancy model).

The left-hand side is given (the balance needs no derivative of pySINDy's); averaged rows on both sides are its
weak form.  Sequentially thresholded least squares drops terms whose rms contribution is below ``threshold``
per mille of bus, rated current or torque, and fits again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scripts.compare.data import Data
from scripts.compare.dictionary import equations
from scripts.compare.naming import dominant, effects

FIT_GRID = [{"rows": rows, "threshold": x} for rows in (5, 20) for x in (0.3, 0.6, 1.2, 2.5, 5.0)]
NAME_GRID = [{"least": x, "share": s} for x in (0.0, 1.0, 2.0, 4.0) for s in (0.0, 0.15, 0.3, 0.5, 0.7)]


@dataclass
class Sparse:
    """sizes: {effect: rms per mille}; left: complex (b,) block means of u that remain [V]."""

    sizes: dict[str, float]
    left: np.ndarray


def fit(data: Data, rows: int, threshold: float) -> Sparse:
    """Select terms for every equation of the case."""
    import pysindy

    found, left = {}, {}
    for e in equations(data, rows):
        optimizer = pysindy.STLSQ(threshold=threshold, alpha=1e-6)
        model = pysindy.SINDy(optimizer=optimizer, feature_library=pysindy.IdentityLibrary())
        model.fit(e.x, t=1.0, x_dot=e.y[:, None], feature_names=e.terms)
        c = model.coefficients()[0]
        found |= {(e.name, e.terms[k]): (c[k] / e.scale[k], abs(c[k])) for k in np.flatnonzero(c)}
        left[e.name] = e.y_blocks - e.blocks @ c
    return Sparse(effects(data, found), (left["u_d"] + 1j * left["u_q"]) * data.units["u"])


def names(fitted: Sparse, least: float, share: float) -> list[str]:
    """Names of what dominates."""
    return dominant(fitted.sizes, least, share)
