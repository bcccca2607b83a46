# SPDX-License-Identifier: BSD-3-Clause
"""Parts of effects whose formula is one of many: a curve beside it, or one of several formulas at a time."""

from __future__ import annotations

from fluxproof.diagnosis.effects.columns import Column
from fluxproof.diagnosis.effects.effect import Effect


class FreeCurve(Effect):
    """An effect with any curve that its variables and symmetry allow, beside the usual formula.

    The free columns have a prior of the share ``curve`` of the formula.  With a curve of 1 no formula is preferred, and
    the free columns count for the size too.
    """

    curve: float = 0.3

    def free(self, view) -> dict[object, Column]:
        """Further columns, {coefficient: column}; no coefficient of ``core`` is among them."""
        raise NotImplementedError

    def columns(self, view):
        return {**self.core(view), **self.free(view)}

    def curve_scale(self, key, cores: dict, nominal) -> float:
        """Coefficient of the free column ``key`` that departs from the formula by as much as the formula itself.

        cores: {coefficient of the formula: its value at the floor}; by default all have one unit.
        """
        return max(cores.values())


class Alternatives(Effect):
    """An effect with several forms, of which a drive has one: groups of mutually exclusive coefficients."""

    one_of: tuple[tuple[str, ...], ...]


def alternatives(effect) -> tuple[tuple[str, ...], ...]:
    """The groups of mutually exclusive coefficients of an effect; () if there are none."""
    return effect.one_of if isinstance(effect, Alternatives) else ()


def free_columns(effect, view) -> dict[object, Column]:
    """The free columns of an effect; {} if it has none."""
    return effect.free(view) if isinstance(effect, FreeCurve) else {}
