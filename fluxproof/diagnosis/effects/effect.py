# SPDX-License-Identifier: BSD-3-Clause
"""What every effect is: its words, the columns of its formula, and the limits of its size.

An effect defines the *columns* (regressors, columns.py) that it adds to the misfit, per unit of its coefficients.  It
is identified by the variables that it depends on, since no real machine follows a formula exactly.  What only some
effects have is a part in a file of its own, from which an effect inherits it (index in __init__.py).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fluxproof.diagnosis.effects.columns import Column
from fluxproof.diagnosis.effects.estimate import Parameter
from fluxproof.diagnosis.ground.result import Estimate

NEEDS = {
    "harmonics": "a row per control period",
    "samples": "the instants of sampling, in a log of the control",
    "time": "a time axis, or several temperatures",
    "angle": "an angle that was measured, not taken from the voltages",
    "inverter": "an inverter that switches",
    "current": "measured currents",
    "voltage": "voltages of the control or of the terminals",
    "torque": "a torque transducer, or a shaft whose acceleration is seen",
}


RELEVANT = 2.0  # of the floor: sensors of class 0.5, constants to two per cent, unless an effect declares another


class Orders(NamedTuple):
    """Orders at which an effect appears in voltage, current sum or torque."""

    electrical: tuple[float, ...] = (0.0,)
    per_turn: tuple[float, ...] = ()  # of the rotor
    trailing: tuple[float, ...] = ()  # electrical: harmonics that the formula may leave


@dataclass(frozen=True)
class Effect:
    """Base class; each effect has its own file, which the catalogue imports automatically."""

    name: str
    title: str  # a noun, as a headline calls it
    equation: str
    signature: str
    separated_by: str  # the experiment that separates it from effects with a similar signature
    parameters: tuple[Parameter, ...]
    needs: tuple[str, ...] = ()  # of NEEDS: what a recording must show for the effect to be seen
    shows_at: Orders = Orders()
    # {parameter: (least, largest) or (least, largest, "machine.key" that they are relative to)} of a usual drive:
    # values outside have low prior odds and are flagged, with another explanation.
    plausible: dict = field(default_factory=dict, hash=False)
    otherwise: str = ""
    beside_torque: str = ""  # as ``separated_by``, of a recording that has the torque already
    clause: str = ""  # of a suspect: completes "the residual looks as if ..."

    @property
    def named(self) -> bool:
        """Whether it may be reported; a suspect, for which the simulation has no parameter, is only described."""
        return not self.clause

    def experiment(self, torque: bool) -> str:
        """What separates it from effects with a similar signature; torque: whether the torque was compared."""
        return self.beside_torque if torque and self.beside_torque else self.separated_by

    def core(self, view) -> dict[object, Column]:
        """Columns of the usual formula, {coefficient: column}."""
        raise NotImplementedError

    def columns(self, view) -> dict[object, Column]:
        """All columns."""
        return self.core(view)

    def floor(self, nominal) -> float:
        """Smallest size at which the effect is reported, in units of ``size``."""
        raise NotImplementedError

    def relevant(self, nominal) -> float:
        """Smallest size that an engineer would act on, in units of ``size``: a smaller one is a note, no cause."""
        return RELEVANT * self.floor(nominal)

    def ceiling(self, nominal) -> float:
        """Largest usual size, in units of ``size``: it sets the prior, and what is larger is impossible (too_large)."""
        return float("inf")

    def often(self, nominal) -> float | None:
        """Size up to which a larger one is no rarer, in units of ``size``; None: the mean of floor and ceiling."""
        return None

    def size(self, c: dict, nominal) -> float:
        """Size of the effect as one number, in the unit of its ``floor``; c: {coefficient: value}, as everywhere."""
        return abs(next(iter(c.values())))

    def too_large(self, c: dict, view) -> bool:
        """Whether coefficients c are impossible in a drive that runs."""
        return self.size(c, view.nominal) > self.ceiling(view.nominal)

    def possible(self, c: dict, covariance: np.ndarray, nominal) -> bool:
        """Whether the coefficients are physically possible within their uncertainty; covariance in their order."""
        return True

    def doubt(self, c: dict, view) -> np.ndarray | float:
        """Voltage (b,) [V] by which any curve of the effect may be wrong, in addition to a share of its value."""
        return 0.0

    def estimates(self, c: dict, covariance: np.ndarray, nominal) -> dict[str, Estimate]:
        """Parameters of the effect, {name: Estimate}, from its coefficients in the order of the covariance."""
        raise NotImplementedError

    def plant(self, c: dict, nominal) -> dict:
        """The effect as parameters of the plant, {"machine.resistance_ohm": 1.7, ...}."""
        return {}
