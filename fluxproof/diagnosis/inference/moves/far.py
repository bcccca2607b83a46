# SPDX-License-Identifier: BSD-3-Clause
"""Effects that are far from linear, from several starts."""

from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.balance.cells import voltage_level
from fluxproof.diagnosis.effects import FarStart
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.inference.converge import around, converged, fit_at
from fluxproof.diagnosis.inference.fitted_set import FittedSet, possible
from fluxproof.diagnosis.inference.judged import CONVERGED, Judged, Names
from fluxproof.diagnosis.inference.moves.neighbours import near


def far(judged: Judged, best: Names):
    """Approach an effect from its ``starts``, and judge sets around it: an angle that is off by a radian."""
    setup = judged.setup
    means = (setup.cells.channel == "u") & (setup.cells.order == 0.0)
    if np.sum(setup.cells.y[means] ** 2) < k.FAR**2 * np.sum(voltage_level(setup.view) ** 2):
        return
    for name in (n for n in judged.first.able() if isinstance(setup.effects[n], FarStart)):
        fit = _approached(setup, name)
        if fit is not None and fit.value > judged.fits[(name,)].value:
            judged.fits[(name,)] = replace(fit, own=True)
            problem = around(setup, fit)
            if problem is not None:
                judged.judge(problem, near(judged, problem, (name,)))


def _approached(setup, name) -> FittedSet | None:
    """An effect alone where it stands after an approach from the best of its starts, or None."""
    tried = [fit_at(setup, {name: c}) for c in setup.effects[name].starts]
    nearest = max((f for f in tried if f is not None), key=lambda f: f.value, default=None)
    fit = None if nearest is None else converged(setup, nearest, CONVERGED)
    return fit if fit is not None and possible(fit) else None
