# SPDX-License-Identifier: BSD-3-Clause
"""Parts of effects that depend on what else is known: from the drive file, or from the other effects found."""

from __future__ import annotations

from dataclasses import replace

from fluxproof.diagnosis.effects.columns import Column
from fluxproof.diagnosis.effects.effect import Effect


class Described(Effect):
    """An effect that an improved drive file may contain already; the misfit is what is left beyond that."""

    def given(self, view, plant) -> Column:
        """Its column as [plant] of the drive file describes it; plant: plant_of the file."""
        raise NotImplementedError


class Relative(Effect):
    """An effect whose coefficients are shares of a parameter that another effect may have changed."""

    def relative(self, c: dict[str, dict], nominal) -> float:
        """Factor on the coefficients that follows from the named effects; c: {effect: coefficients}."""
        raise NotImplementedError


class Restates(Effect):
    """An effect that changes constants of the drive file to which the sizes of other effects are added."""

    def of(self, nominal, c: dict) -> dict[str, float]:
        """{key of [machine]: its value with coefficients c}."""
        raise NotImplementedError

    def twin(self, c: dict) -> str:
        """The effect that leaves the same voltages as coefficients c at every operating point."""
        raise NotImplementedError


class Caveat(Effect):
    """An effect whose estimates leave something open in some recordings."""

    def caveat(self, view, c: dict) -> str:
        """What coefficients c leave open, as a sentence; "" if nothing."""
        raise NotImplementedError


def relative(effect, c: dict[str, dict], nominal) -> float:
    """Factor on the coefficients of any effect."""
    return effect.relative(c, nominal) if isinstance(effect, Relative) else 1.0


def restated(effects, c: dict[str, dict], nominal):
    """The drive to which the sizes of effects that restate nothing are added; c: {effect: coefficients}."""
    for name, own in c.items():
        if isinstance(effects[name], Restates):
            machine = replace(nominal.machine, **effects[name].of(nominal, own))
            nominal = replace(nominal, machine=machine)
    return nominal


def caveat(effect, view, c: dict) -> str:
    """What the estimates of any effect leave open."""
    return effect.caveat(view, c) if isinstance(effect, Caveat) else ""
