# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the named effects with standard deviations.

The posterior covariance of a set holds noise, discrepancy and the balance's common error.  The differences between the
sets that share the posterior's mass are added.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.effects.drive_file import Restates, relative, restated
from fluxproof.diagnosis.ground.plant_section import in_addition
from fluxproof.diagnosis.ground.result import Estimate, NamedEffect
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import FittedSet, covariance_of


def without_possible(names, best: FittedSet) -> tuple[FittedSet, float]:
    """(the best set without the effects that are only possible, the probability that one of them is not there)."""
    possible = names.only_possible(best)
    if not possible:
        return best, 0.0
    fewer = fit_set(best.problem, [n for n in best.names if n not in possible])
    return fewer, 1.0 - min((names.possible | names.sizeless).get(n, 0.0) for n in possible)


def named_effects(names, posterior, explains, only=None) -> list[NamedEffect]:
    """The named effects of the best set; explains: {effect: share}; only: names in place of the named ones."""
    best = posterior.best()
    effects, nominal = posterior.setup.effects, best.problem.view.nominal
    out = []
    fewer, absent = without_possible(names, best)
    given = nominal
    for name in sorted(names.named if only is None else only):
        effect, c = effects[name], best.c[name]
        nominal = given if isinstance(effect, Restates) else restated(effects, best.c, given)
        simpler = c | fewer.c.get(name, {})
        c = {key: (1.0 - absent) * v + absent * simpler.get(key, 0.0) for key, v in c.items()}
        estimates = effect.estimates(c, covariance_of(best, name, best.cov), nominal)
        estimates = _with_absence(estimates, effect, (best.c[name], simpler), absent, nominal)
        estimates = _with_other_sets(estimates, name, names.fits)
        share = relative(effect, {n: best.c[n] for n in best.names}, nominal)
        if share != 1.0:
            estimates = {key: _shared(e, share) for key, e in estimates.items()}
        plant = in_addition(effect.plant({key: share * v for key, v in c.items()}, nominal), nominal)
        confidence = names.named.get(name, 0.0)
        out.append(NamedEffect(name, float(min(confidence, 0.999)), estimates, explains.get(name, 0.0), plant))
    own = {key for e in out if not isinstance(effects[e.name], Restates) for key in e.plant}
    return [_without(e, own) if isinstance(effects[e.name], Restates) else e for e in out]


def _without(effect: NamedEffect, keys) -> NamedEffect:
    """An effect without the keys of the plant that others state in full."""
    return replace(effect, plant={key: value for key, value in effect.plant.items() if key not in keys})


def estimates_in(fit, name) -> dict[str, Estimate]:
    """Parameters of an effect as a set of effects has them."""
    effects, nominal = fit.problem.setup.effects, fit.problem.view.nominal
    given = nominal if isinstance(effects[name], Restates) else restated(effects, fit.c, nominal)
    return effects[name].estimates(fit.c[name], covariance_of(fit, name, fit.cov), given)


def _with_absence(estimates, effect, ends, absent, nominal) -> dict[str, Estimate]:
    """Estimates with the spread of what they would be without the effects that are only possible.

    ends: coefficients with and without those; absent: probability that they are not there.
    """
    exact = np.zeros((len(ends[0]),) * 2)
    first, last = (effect.estimates(c, exact, nominal) for c in ends)
    out = {}
    for key, e in estimates.items():
        moved = last[key].value - first[key].value if key in first and key in last else 0.0
        out[key] = replace(e, sigma=float(np.hypot(e.sigma, np.sqrt(absent * (1.0 - absent)) * moved)))
    return out


def _with_other_sets(estimates, name, fits) -> dict[str, Estimate]:
    """Estimates with the spread over the sets that share the posterior's mass."""
    total, out = sum(p for p, _ in fits), dict(estimates)
    for p, fit in fits[1:]:
        if name not in fit.names:
            continue
        other = estimates_in(fit, name)
        for key, e in out.items():
            if key in other:
                sigma = float(np.sqrt(e.sigma**2 + p / total * (other[key].value - e.value) ** 2))
                out[key] = replace(e, sigma=sigma)
    return out


def _shared(e: Estimate, share) -> Estimate:
    """The part of an estimate that is the effect's own.

    The reference may be either resistance: ohms beyond the nameplate may lie outside the winding.
    """
    return replace(e, value=share * e.value, sigma=float(np.hypot(share * e.sigma, (1.0 - share) * e.value)))
