# SPDX-License-Identifier: BSD-3-Clause
"""Notes on a decision: what its balance covers, and what is withheld and why."""

from __future__ import annotations

from fluxproof.diagnosis.decide.decision import (
    CONSTANT,
    IMITATION,
    INSIGNIFICANT,
    NOISE,
    SIZELESS,
    Basis,
    Decision,
    Withheld,
)
from fluxproof.diagnosis.decide.verdict import WHOLE
from fluxproof.diagnosis.effects.drive_file import caveat
from fluxproof.diagnosis.words.balance_notes import balance_notes
from fluxproof.diagnosis.words.best_fit import minor_notes
from fluxproof.diagnosis.words.one_point_notes import one_point_notes
from fluxproof.diagnosis.words.phrases import as_if, capital, percent_below, title_of


def notes_of(decision: Decision, effects) -> list[str]:
    """The notes on a decision; effects: the catalogue with the causes beyond it."""
    basis = decision.basis
    if basis is None:
        return []
    withheld = lambda *why: [_withheld(w, effects) for w in decision.withheld if w.why in why]  # noqa: E731
    return [
        *withheld(IMITATION),
        *_of_balance(decision, basis),
        *(f"The residual also looks {as_if(term)}." for term in decision.alike),
        *withheld(CONSTANT, SIZELESS),
        *withheld(NOISE, INSIGNIFICANT),
        *minor_notes(decision.minor, effects),
        *_hint(decision),
    ]


def _withheld(w: Withheld, effects) -> str:
    """Why an effect is not reported."""
    why = {
        IMITATION: f"would explain {100 * w.size:.0f} %; not reported, as the large residual may imitate it.",
        CONSTANT: "would explain the drift; not reported, as the constant misfit is unexplained and may imitate it.",
        SIZELESS: "not reported, as its size is compatible with zero in this recording.",
        NOISE: f"possible ({percent_below(w.size)}), but recording and simulation already agree within noise.",
        INSIGNIFICANT: f"possible ({percent_below(w.size)}), but not significant.",
    }
    return f"{capital(title_of(w.effect, effects))}: {why[w.why]}"


def _of_balance(decision: Decision, basis: Basis) -> list[str]:
    """What the balance used and cannot show, and what the model of a named effect leaves out at these points."""
    if basis.one_point is not None:
        return one_point_notes(basis.view, basis.one_point, basis.held)
    if basis.posterior is None:
        return []
    best, effects = basis.posterior.best(), basis.posterior.setup.effects
    caveats = (caveat(effects[e.name], basis.view, best.c[e.name]) for e in decision.effects)
    return [*balance_notes(basis.view, basis.held, effects, decision.ambiguity), *filter(None, caveats)]


def _hint(decision: Decision) -> list[str]:
    """An interpretation that would fit better and is not asserted."""
    if not decision.hinted:
        return []
    says = "; or ".join(r.says for r in decision.hinted)
    if decision.verdict in WHOLE:
        return [f"Or {says}: with fewer causes, that explains the misfit too, and this recording cannot separate them."]
    return [f"The interpretation that {says} would fit better, but a large residual remains, so this is only a hint."]
