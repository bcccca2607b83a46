# SPDX-License-Identifier: BSD-3-Clause
"""Joint least squares: all parameters of the drive model at once, scipy.optimize.least_squares.

An effect is named if the 95 % interval of its parameter (or region of its parameters) excludes the nominal value and
the change exceeds a floor.  Intervals follow from the Jacobian and the variance of the residual, as usual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2

from studies.compare.data import Data, averaged
from studies.compare.joint_model import PARAMETERS, Model
from studies.compare.naming import one_factor

MOST_BLOCKS = 90  # evenly chosen; more would only take longer
FIT_GRID = [{"rows": 20}]
NAME_GRID = [
    {"floor": f, "share": s} for f in (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5) for s in (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5)
]
STEP = 1e-3  # of a parameter's unit, for slopes
FACTORS = {"resistance": "R", "inductance_d": "L_d", "inductance_q": "L_q", "magnet_flux": "psi_m"}
SINGULAR = 1e-6  # of the largest singular value: directions below it are undetermined


@dataclass
class Joint:
    """values: {effect: (k,)} in units of PARAMETERS, covariances: {effect: (k, k)}, impact: {effect: rms V or share};
    left: complex (b,) block means of u that remain [V]."""

    values: dict[str, np.ndarray]
    covariances: dict[str, np.ndarray]
    impact: dict[str, float]
    left: np.ndarray


def _stacked(channels, sigma, rows, known):
    """One vector of the averaged channels at ``known`` rows, each over its noise; complex ones as two parts."""
    parts = []
    for name, x in channels.items():
        mean = averaged(x, rows).ravel() / sigma[name]
        mean = mean[known[name]]
        parts += [mean.real, mean.imag] if np.iscomplexobj(mean) else [mean]
    return np.concatenate(parts)


def _sigma(misfit, rows):
    """Standard deviation of a row of each channel, from neighbours and robust."""
    out = {}
    for name, x in misfit.items():
        step = np.diff(averaged(x, rows), axis=1)
        both = np.concatenate([step.real.ravel(), step.imag.ravel()]) if np.iscomplexobj(step) else step.ravel()
        out[name] = float(np.nanmedian(np.abs(both)) / 0.954) + 1e-12
    return out


def fit(data: Data, rows: int) -> Joint:
    """Fit every parameter of the model to the blocks that are not held out."""
    train = np.flatnonzero(~data.held)
    if len(train) > MOST_BLOCKS:
        train = train[np.unique(np.linspace(0, len(train) - 1, MOST_BLOCKS).round().astype(int))]
    model = Model(data, train)
    mine = {name: x[train] for name, x in data.misfit.items()}
    sigma = _sigma(mine, rows)
    known = {name: np.isfinite(averaged(x, rows)).ravel() for name, x in mine.items()}
    y = _stacked(mine, sigma, rows, known)

    def residual(p):
        return _stacked(model(p), sigma, rows, known) - y

    def jacobian(p):
        here = residual(p)
        return np.stack([(residual(p + STEP * e) - here) / STEP for e in np.eye(len(p))], axis=1)

    found = least_squares(residual, np.zeros(len(model.names)), jacobian, method="trf", max_nfev=6)
    s2 = 2.0 * found.cost / max(len(y) - len(found.x), 1)
    _, s, vt = np.linalg.svd(found.jac, full_matrices=False)
    determined = s > SINGULAR * s[0]
    spread = np.where(determined, 1.0 / np.where(determined, s, 1.0), 1e6)
    covariance = s2 * (vt.T * spread**2) @ vt
    rms = np.sqrt(np.mean(found.jac**2, axis=0))
    values, covariances, impact = {}, {}, {}
    for effect in dict.fromkeys(PARAMETERS[name][0] for name in model.names if PARAMETERS[name][0]):
        k = [n for n, name in enumerate(model.names) if PARAMETERS[name][0] == effect]
        values[effect], covariances[effect] = found.x[k], covariance[np.ix_(k, k)]
        impact[effect] = float(np.sqrt(np.sum((rms[k] * found.x[k]) ** 2)))
    after = Model(data)(found.x)
    return Joint(values, covariances, impact, (data.misfit["u"] - after["u"]).mean(axis=1))


def names(fitted: Joint, floor: float, share: float) -> list[str]:
    """Effects whose 95 % region excludes nominal, larger than ``floor`` units, of ``share`` of the largest impact."""
    sure = []
    for effect, x in fitted.values.items():
        distance = float(x @ np.linalg.pinv(fitted.covariances[effect]) @ x)
        if distance > chi2.ppf(0.95, len(x)) and np.linalg.norm(x) > floor:
            sure.append(effect)
    top = max((fitted.impact[e] for e in sure), default=0.0)
    change = {e: float(fitted.values[e][0]) * PARAMETERS[p][1] for e, p in FACTORS.items()}
    return sorted(one_factor([e for e in sure if fitted.impact[e] >= share * top], change))
