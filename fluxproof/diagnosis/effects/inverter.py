# SPDX-License-Identifier: BSD-3-Clause
"""Part of effects of the switching legs, and of torques at the shaft."""

from __future__ import annotations

from fluxproof.diagnosis.effects.effect import Effect


class LegLoss(Effect):
    """A loss of the legs: a function of smoothed currents also where the model is applied, which moves the pulses."""

    def late_s(self, c: dict, nominal) -> float:
        """Shift of the middle of every pulse [s] that it causes beside its own voltage."""
        raise NotImplementedError


def late_s(effect, c: dict, nominal) -> float:
    """Shift of the middle of every pulse [s] by any effect."""
    return effect.late_s(c, nominal) if isinstance(effect, LegLoss) else 0.0


class ShaftTorque(Effect):
    """A torque of the shaft rather than a voltage of the machine: seen with a transducer or a free shaft only."""
