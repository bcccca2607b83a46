# SPDX-License-Identifier: BSD-3-Clause
"""Effects that are rejected whatever their probability, so that the others are judged again without them.

An effect worsens the prediction at points that were not fitted, or its size is compatible with zero (sized.py).
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.decide.decision import HELD_OUT, SIZELESS
from fluxproof.diagnosis.decide.names import names_of
from fluxproof.diagnosis.decide.sized import sizeless
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.search import within


def without_idle(posterior, held):
    """The posterior without effects that worsen the prediction at held-out points, and without names without a size.

    The others are judged again without them; ``posterior.idle`` says why they were rejected.
    """
    while True:
        names = names_of(posterior)
        worse = {n for n in names.asserted & set(posterior.best().names) if not helps(posterior, n, held)}
        idle = dict.fromkeys(worse, HELD_OUT) or dict.fromkeys(sizeless(names, posterior), SIZELESS)
        if not idle:
            return posterior
        # A drift without a size may have stood for a constant, which is in none of the probable sets beside it.
        sets = [fit.names for _, fit in names.fits] if worse else posterior.fits
        others = {n for effects in sets for n in effects}
        posterior = within(posterior, others - idle.keys(), idle)


def helps(posterior, name, held) -> bool:
    """Whether the best set leaves no less without ``name``, of the held-out and of the fitted blocks together.

    Both count alike, in units of the usual error: an effect that explains nothing leaves as much of the fitted blocks
    without it and more of the others, while a drift that is only wrong about the minutes held out still explains most.
    Rows beyond the fitted operating points, of which the coefficients' own uncertainty exceeds that error, do not
    count, but for a mean torque in which a load may act, as that uncertainty is the load's.  The torque counts without
    a transducer too: friction and cogging of a free shaft show nowhere else.  Where a load may act that nobody
    recorded, what is left counts up to a limit.
    """
    best, setup = posterior.best(), posterior.setup
    cells, floor2 = setup.cells, setup.usual**2
    loads = (cells.channel == "torque") & (cells.order == 0) & (setup.load > 0.0)
    rows = np.flatnonzero(cells.ok)
    unseen = held[cells.block[rows]]
    certain = ~unseen | loads[rows] | (_uncertain(best, rows) <= floor2[rows])
    rows, unseen = rows[certain], unseen[certain]
    fewer = fit_set(best.problem, [n for n in best.names if n != name])
    left2 = [fit.left()[rows] ** 2 for fit in (best, fewer)]
    left2 = [np.where(loads[rows], np.minimum(x, k.DISCREPANCY**2 * floor2[rows]), x) for x in left2]
    left = np.zeros(2)
    # The ripple of a free shaft's acceleration is mostly noise, beside which its mean would not count.
    channels = np.where((cells.channel == "torque") & (cells.order == 0), "mean torque", cells.channel)[rows]
    for channel in np.unique(channels):
        for part in (unseen, ~unseen):
            mine = (channels == channel) & part
            if mine.any():
                left += [x[mine].sum() / floor2[rows][mine].sum() for x in left2]
    return left[1] >= left[0]


def _uncertain(fit, rows) -> np.ndarray:
    """Variance of what a fit explains of some rows, (k,)."""
    keys = [fit.problem.keys[n] for n in fit.take]
    x = np.array([fit.problem.cells.columns[name][key][rows] for name, key in keys]).reshape(len(keys), len(rows))
    return np.sum(x * (fit.cov @ x), axis=0)
