# SPDX-License-Identifier: BSD-3-Clause
"""Parts of effects that the search for the best set treats in a way of their own."""

from __future__ import annotations

from fluxproof.diagnosis.effects.effect import Effect


class FarStart(Effect):
    """An effect that may be far from linear: a large misfit is also approached from these coefficients."""

    starts: tuple[dict, ...]


class Chosen(Effect):
    """An effect whose columns were chosen among several by the recording, such as the order of a torque."""

    def log_choice(self, view) -> float:
        """Log of the prior probability of what was chosen."""
        raise NotImplementedError


class Spread(Effect):
    """A constant that varies from drive to drive, so that every set of a fleet includes it."""


def log_choice(effect, view) -> float:
    """Log of the prior probability of what was chosen for the columns of any effect."""
    return effect.log_choice(view) if isinstance(effect, Chosen) else 0.0
