# SPDX-License-Identifier: BSD-3-Clause
"""Part of effects that change during a recording."""

from __future__ import annotations

from fluxproof.diagnosis.effects.effect import Effect


class Drift(Effect):
    """A constant effect that drifts slowly, as with temperature; a cold machine is without it."""

    drift_of: str  # the constant effect

    def moved(self, c: dict, view) -> float:
        """Change over the recording, in units of ``size``."""
        return self.size(c, view.nominal)

    def expected(self, view) -> bool:
        """Whether the recording itself says that it acts, as a recorded temperature says of a resistance."""
        return False


def moved(effect, c: dict, view) -> float:
    """Change of any effect over a recording, in units of ``size``."""
    return effect.moved(c, view) if isinstance(effect, Drift) else effect.size(c, view.nominal)
