# SPDX-License-Identifier: BSD-3-Clause
"""Sets around the best ones that correct other measurement errors."""

import numpy as np

from fluxproof.diagnosis.inference.converge import around
from fluxproof.diagnosis.inference.judged import Judged, Names
from fluxproof.diagnosis.inference.moves.neighbours import near

OTHERS = 3  # sets of measurement errors


def within_errors(judged: Judged, best: Names):
    """Judge sets with the same measurement errors as a good set on its linearisation.

    Where an angle is off, say, the cause beside it is judged rightly only on data whose angle is corrected, and by
    nothing else: what the best set corrects besides makes others look worse than they are.
    """
    judged.around.add(judged.errors(best))
    good = {}
    for fit in judged.ranked(lambda f: f.own and f.stands and np.isfinite(f.value)):
        good.setdefault(judged.errors(fit.names), fit)
    for errors, fit in list(good.items())[:OTHERS]:
        if errors and errors not in judged.around:
            judged.around.add(errors)
            problem = around(judged.setup, fit)
            if problem is not None:
                sets = near(judged, problem, fit.names)
                judged.judge(problem, [s for s in sets if judged.errors(s) == errors])
