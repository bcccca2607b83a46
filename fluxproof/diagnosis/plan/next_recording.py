# SPDX-License-Identifier: BSD-3-Clause
"""The next recording that a decision asks for: none without an ambiguity or a cause that one point cannot confirm."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.orders import at_order
from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.plan.one_point import points_beside
from fluxproof.diagnosis.plan.planned import Planned
from fluxproof.diagnosis.plan.request import requests, wants_cold


def next_recording(decision: Decision, progress=lambda text: None) -> tuple[Planned, ...]:
    """The operating points that separate the ambiguities of a decision."""
    basis = decision.basis
    if basis is None:
        return ()
    if basis.posterior is None:
        best = decision.best_fit
        likely = (tuple(e.name for e in best.effects),) if best is not None else ()
        return points_beside(basis.view, decision.ambiguity or likely)
    if not decision.ambiguity:
        return ()
    progress("choosing the next recording")
    setup = basis.posterior.setup
    if not basis.view.has_voltage.any():  # a point is planned by the voltage that it would show
        return ()
    noise_v = float(np.nanmedian(np.abs(at_order(setup.cells, setup.noise, 0.0))))
    ambiguous = sorted({n for group in decision.ambiguity for n in group})
    return requests(setup, basis.rivals, noise_v, wants_cold(ambiguous, setup.effects, setup.view))
