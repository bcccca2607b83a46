# SPDX-License-Identifier: BSD-3-Clause
"""Which effects of a case are identifiable from its recording, independent of the estimator.

An effect counts as identifiable unless another set of catalogue effects, no larger than the true one and without that
effect, gives the same rows within the noise and a floor (design.py).  The analysis is first-order and covers steady
operating points only; an effect judged unidentifiable may still show in a transient, but hardly the reverse.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from studies.blind import forms
from studies.blind.design import Design

ENOUGH = 100.0  # squared distance, in standard deviations, at which two explanations are separable
PRIOR = 6.0  # typical sizes beyond which an explanation is implausible


def judge(case) -> dict:
    """{"all": bool, "effects": {name: bool}, "rivals": [[names], ...]}, the rivals closest first."""
    names = case.names
    if not names:
        return {"all": True, "effects": {}, "rivals": []}
    design = Design(case)
    y = design.truth()
    groups = [(name, v) for name in sorted(forms.EFFECTS) for v in design.variants(name)]
    owner = np.array([k for k, (_, columns) in enumerate(groups) for _ in columns])
    a = np.array([c for _, columns in groups for c in columns]).T
    gram, against, total = a.T @ a + np.eye(len(owner)) / PRIOR**2, a.T @ y, float(y @ y)
    rivals = []
    for size in range(len(names) + 1):
        for chosen in combinations(range(len(groups)), size):
            rival = [groups[k][0] for k in chosen]
            if len(set(rival)) < size or set(names) <= set(rival):
                continue
            take = np.flatnonzero(np.isin(owner, chosen))
            left = total
            if len(take):
                left -= float(against[take] @ np.linalg.solve(gram[np.ix_(take, take)], against[take]))
            if left < ENOUGH:
                rivals.append((left, rival))
    rivals.sort(key=lambda entry: entry[0])
    verdict = {name: all(name in rival for _, rival in rivals) for name in names}
    return {"all": all(verdict.values()), "effects": verdict, "rivals": [rival for _, rival in rivals[:12]]}
