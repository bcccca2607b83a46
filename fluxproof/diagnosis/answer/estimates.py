# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the named effects with standard deviations.

The posterior covariance of a set holds noise, discrepancy and the balance's common error.  The differences between the
sets that share the posterior's mass are added.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.effects.drive_file import relative
from fluxproof.diagnosis.ground.plant_section import in_addition
from fluxproof.diagnosis.ground.result import NamedEffect
from fluxproof.diagnosis.inference.problem import covariance_of


def without_possible(names, best):
    """(the best set without the effects that are only possible, the probability that one of them is not there)."""
    possible = names.only_possible(best)
    if not possible:
        return best, 0.0
    fewer = best.problem.fit([n for n in best.names if n not in possible])
    return fewer, 1.0 - min(names.maybe.get(n, 0.0) for n in possible)


def named_effects(names, posterior, explains, only=None) -> list[NamedEffect]:
    """The named effects of the best set; explains: {effect: share}; only: names in place of the named ones."""
    best = posterior.best()
    effects, nominal = posterior.setup.effects, best.problem.view.nominal
    out = []
    total = sum(p for p, _ in names.fits)
    fewer, absent = without_possible(names, best)
    for name in sorted(names.confidence if only is None else only):
        effect, c = effects[name], best.c[name]
        simpler = fewer.c.get(name, c)
        c = {key: (1.0 - absent) * v + absent * simpler.get(key, 0.0) for key, v in c.items()}
        share = relative(effect, {n: best.c[n] for n in best.names}, nominal)
        estimates = effect.estimates(c, covariance_of(best, name, best.cov), nominal)
        exact = np.zeros((len(c),) * 2)
        ends = [effect.estimates(x, exact, nominal) for x in (best.c[name], simpler)]
        for key, e in estimates.items():
            moved = ends[1][key].value - ends[0][key].value if key in ends[1] else 0.0
            e.sigma = float(np.hypot(e.sigma, np.sqrt(absent * (1.0 - absent)) * moved))
        for p, fit in names.fits[1:]:
            if name not in fit.names:
                continue
            other = effect.estimates(fit.c[name], covariance_of(fit, name, fit.cov), nominal)
            for key, e in estimates.items():
                if key in other:
                    e.sigma = float(np.sqrt(e.sigma**2 + p / total * (other[key].value - e.value) ** 2))
        for e in estimates.values() if share != 1.0 else ():
            # The reference may be either resistance: ohms beyond the nameplate may lie outside the winding.
            e.value, e.sigma = share * e.value, float(np.hypot(share * e.sigma, (1.0 - share) * e.value))
        plant = in_addition(effect.plant({key: share * v for key, v in c.items()}, nominal), nominal)
        confidence = names.confidence.get(name, 0.0)
        out.append(NamedEffect(name, float(min(confidence, 0.999)), estimates, explains.get(name, 0.0), plant))
    return out
