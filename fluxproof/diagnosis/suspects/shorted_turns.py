# SPDX-License-Identifier: BSD-3-Clause
"""Turns of one phase that are shorted: their EMF drives a current in the short, which the terminals do not see."""

import numpy as np

from fluxproof.diagnosis.effects import Alternatives, FreeCurve, Orders, Parameter, current_error, one, sigma
from fluxproof.plant.transforms import ANGLES, linear_limit

PHASES = "abc"
LAG_S = 1e-4  # time in which the current of the short follows its EMF, L / R of the shorted turns


def _short(view, phase):
    """{"": column of the resistive current, "_lag": of its lag} of one phase, per siemens referred to the phase."""
    axis = np.exp(1j * (ANGLES[phase] - view.theta))
    columns = {}
    for name, turned in {"": 1.0, "_lag": -1j * view.omega * LAG_S}.items():
        emf = (1j * view.omega * turned * view.psi * np.conj(axis)).real
        columns[name] = current_error(view, (2.0 / 3.0) * emf * axis)
    return columns


class ShortedTurns(FreeCurve, Alternatives):
    one_of = tuple((phase, f"{phase}_lag") for phase in PHASES)

    def core(self, view):
        return {phase: _short(view, phase)[""] for phase in PHASES}

    def free(self, view):
        return {f"{phase}_lag": _short(view, phase)["_lag"] for phase in PHASES}

    def floor(self, nominal):
        return 0.005 * nominal.machine.rated_current_a / self._rated_emf(nominal)

    def too_large(self, c, view):
        """Whether the current of the short, referred to the phase, exceeds rated current at the highest speed."""
        emf = view.top_speed * view.machine.magnet_flux_wb
        return self.size(c, view.nominal) * emf > view.machine.rated_current_a

    @staticmethod
    def _rated_emf(nominal):
        return linear_limit(nominal.inverter.dc_bus_v)

    def possible(self, c, covariance, nominal):
        """A short consumes power."""
        return all(c.get(phase, 0.0) >= 0.0 for phase in PHASES)

    def size(self, c, nominal):
        return max(abs(c.get(phase, 0.0)) for phase in PHASES)

    def estimates(self, c, covariance, nominal):
        phase = max(PHASES, key=lambda x: abs(c.get(x, 0.0)))
        return one(f"conductance_{phase}_s", "S", c[phase], sigma(covariance, list(c).index(phase)))


EFFECT = ShortedTurns(
    name="shorted_turns",
    title="shorted turns",
    clause="turns of one phase were shorted",
    equation="i = i_terminal - (2/3) g Re(j omega psi e^(-j phase)) e^(j phase)",
    signature="orders 0 and -2 of equal size, proportional to omega^2, and a drag torque",
    separated_by="standstill, where a short vanishes but a resistance or gain error of one phase does not",
    parameters=tuple(Parameter(f"conductance_{x}_s", "S", f"of the short, referred to phase {x}") for x in PHASES),
    needs=("harmonics", "angle"),
    shows_at=Orders((0.0, 2.0)),
)
