# SPDX-License-Identifier: BSD-3-Clause
"""Parts of effects that act on the flux linkage of the machine."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.effects.columns import flux
from fluxproof.diagnosis.effects.effect import Effect
from fluxproof.diagnosis.effects.free_curve import FreeCurve

LEAST_CURRENT = 0.08  # of rated current: an axis with less current does not determine a curve over it


class FluxEffect(FreeCurve):
    """An effect that is a flux linkage of the machine, given as shapes per unit of its coefficients."""

    def core_psi(self, view) -> dict[object, np.ndarray]:
        """Flux shapes of the usual formula, {coefficient: (b, m+1) complex dq}."""
        raise NotImplementedError

    def free_psi(self, view) -> dict[object, np.ndarray]:
        """Further flux shapes."""
        return {}

    def core(self, view):
        return {name: flux(view, psi) for name, psi in self.core_psi(view).items()}

    def free(self, view):
        return {name: flux(view, psi) for name, psi in self.free_psi(view).items()}

    def psi(self, view, c) -> np.ndarray | float:
        """The effect's flux linkage, (b, m+1) complex dq [Wb]."""
        shapes = {**self.core_psi(view), **self.free_psi(view)}
        return sum(value * shapes[name] for name, value in c.items() if value)

    def delta_l(self, c) -> tuple[float, float]:
        """Its contribution to (L_d, L_q) [H]."""
        return 0.0, 0.0

    def inductances(self, c, machine) -> tuple[float, float]:
        """The same of a machine with these nominal constants."""
        return self.delta_l(c)


class BentFlux(FluxEffect):
    """A flux linkage that is no line of the current: the answer contains it as a flux map."""


class LostFlux(Effect):
    """An effect whose current does not magnetise, as that of the iron."""

    def lost_flux(self, view, c) -> np.ndarray:
        """Missing flux linkage (b, m+1) complex dq [Wb]."""
        raise NotImplementedError
