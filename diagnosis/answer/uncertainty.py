"""Sizes and confidences of the effects of a solution found in a slow log."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.answer.improved_plant import in_addition
from fluxproof.diagnosis.result import NamedEffect

LEAST_DISPERSION = 0.8
LEAST, MOST = 0.5, 0.999  # stated confidence


def named(solution, effects, nominal, names, empty, dispersion) -> list[NamedEffect]:
    """The effects ``names`` of a solution with their parameters; empty: the solution without effects.

    The fit's own covariances are scaled by the dispersion, chi^2 per degree of freedom.
    """
    explained = max(empty.chi2 - empty.rows, 1e-9)
    fall = float(np.clip((empty.chi2 - solution.chi2) / explained, 0.0, 1.0))
    out = []
    for name in names:
        effect, c = effects[name], solution.c[name]
        covariance = solution.covariance[name] * max(dispersion, LEAST_DISPERSION)
        share = effect.relative({n: solution.c[n] for n in names}, nominal)
        estimates = effect.estimates(c, covariance, nominal)
        for e in estimates.values() if share != 1.0 else ():
            # The reference may be either resistance: ohms beyond the nameplate may lie outside the winding.
            e.value, e.sigma = share * e.value, float(np.hypot(share * e.sigma, (1.0 - share) * e.value))
        sure = 1.0 - 1.0 / (1.0 + weight(c, covariance) / 4.0)
        plant = in_addition(effect.plant({key: share * v for key, v in c.items()}, nominal), nominal)
        out.append(NamedEffect(name, float(np.clip(sure, LEAST, MOST)), estimates, fall, plant))
    return out


def weight(c, covariance) -> float:
    """Squared coefficients of an effect in standard deviations (Mahalanobis distance), per coefficient."""
    values = np.array(list(c.values()))
    return float(values @ np.linalg.pinv(covariance) @ values) / max(len(values), 1)
