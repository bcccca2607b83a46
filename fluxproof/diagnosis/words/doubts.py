# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of an answer outside the range that their effects declare as plausible."""

from __future__ import annotations

from fluxproof.diagnosis.effects import believable, plausible_range
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.words.phrases import capital, size_text, title_of

IMPLAUSIBLE = "is implausible"


def doubts(answer, nominal, effects) -> list[str]:
    """Notes on parameters of named effects outside of what the effects declare as plausible."""
    notes = []
    for e in answer.effects:
        entry = effects.get(e.name)
        for key, limits in entry.plausible.items() if entry else ():
            estimate = e.parameters.get(key)
            if estimate is None:
                continue
            if believable(estimate, limits, nominal):
                continue
            low, high = plausible_range(limits, nominal)
            called = next(p.called for p in entry.parameters if p.name == key)
            usual = f"{ascii_of(quantity(low, estimate.unit, 3))} to {ascii_of(quantity(high, estimate.unit, 3))}"
            notes.append(
                f"{capital(title_of(e.name, effects))}: {called} {size_text(estimate)} {IMPLAUSIBLE} (usual: {usual}). "
                f"Perhaps {entry.otherwise}."
            )
    return notes
