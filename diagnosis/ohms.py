"""Bounds the resistance that the inverter's voltage-drop curve does not explain.

Beyond a tenth of the rated current, a device has a drop in log(i), a commutation loss in 1/i (capacitance of the leg),
or both, and neither decreases the loss.  The balance is seldom accurate enough to distinguish them, so that the
resistances fitted with each of them form a range.  A curve that is free everywhere would absorb the resistance.
"""

from __future__ import annotations

import itertools

import numpy as np

from fluxproof.diagnosis.catalogue.dead_time import device_tails
from fluxproof.diagnosis.effect import DOUBT

LEAST_DISPERSION = 0.8


def straight_ohms(search, solution) -> tuple[float, float]:
    """(least, most) ohmic voltage [V] at rated current in addition to a solution's dead time, with its uncertainty.

    The solution has dead time and a resistance; (-inf, inf) if the data do not determine the resistance.
    """
    f = search.fitter(solution.view, [search.effects[n] for n in sorted(solution.model.names)])
    kept = [k for k in f.carried(solution.model) if (f.owner[k], f.names[k]) != ("dead_time", "~growth")]
    ohms = next((n for n, k in enumerate(kept) if (f.owner[k], f.names[k]) == ("resistance", "delta_r")), None)
    if ohms is None:
        return -np.inf, np.inf
    tails = [
        search.projector.rows(column)[f.use] / f.sigma[f.use] for column in device_tails(solution.view).values()
    ]
    growing = [some for count in (1, 2) for some in itertools.combinations(tails, count)]
    fits = [fit for some in growing if (fit := _fit(f, kept, some, ohms))] or [_fit(f, kept, (), ohms)]
    per_volt = f.scale[kept[ohms]] / solution.view.machine.rated_current_a
    return min(v - DOUBT * s for v, s in fits) / per_volt, max(v + DOUBT * s for v, s in fits) / per_volt


def _fit(f, kept, tails, ohms):
    """(value, standard deviation) of column ``ohms`` fitted with the device terms (r,); None if one is negative."""
    a = np.column_stack([f.a[:, kept], *(row / np.linalg.norm(row) for row in tails)])
    c, *_ = np.linalg.lstsq(a, f.y, rcond=None)
    if len(tails) and c[len(kept) :].min() < 0.0:
        return None
    wider = max(float(np.sum((f.y - a @ c) ** 2)) / max(len(f.y) - len(c), 1), LEAST_DISPERSION)
    return float(c[ohms]), float(np.sqrt(wider * np.linalg.pinv(a.T @ a)[ohms, ohms]))
