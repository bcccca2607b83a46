# SPDX-License-Identifier: BSD-3-Clause
"""Current sensors that are no longer linear towards full scale, as behind a core or an amplifier that saturates."""

from typing import NamedTuple

import numpy as np

from fluxproof.diagnosis.effects import FreeCurve, MeasurementError, Orders, Parameter, phase_error
from fluxproof.diagnosis.ground.result import Estimate
from fluxproof.plant.transforms import PATTERNS

PHASES = {**PATTERNS, "common": (1.0, 1.0, 1.0)}


class Bend(NamedTuple):
    """Key of a coefficient: a power of the phase currents, with the weights of a pattern."""

    power: int
    pattern: str


def _errors(view, powers=(3, 5)):
    """{Bend: (b, m+1, 3)} errors of the phase currents [A] per unit of the coefficients."""
    x = view.phases(view.i) / view.machine.rated_current_a
    square = x * x  # a general power of an array takes sixty times as long
    bent = {3: view.machine.rated_current_a * square * x, 5: view.machine.rated_current_a * square * square * x}
    return {Bend(power, name): bent[power] * np.array(weights) for power in powers for name, weights in PHASES.items()}


class CurrentBend(MeasurementError, FreeCurve):
    def core(self, view):
        return {key: phase_error(view, error) for key, error in _errors(view, (3,)).items()}

    def free(self, view):
        return {key: phase_error(view, error) for key, error in _errors(view, (5,)).items()}

    def floor(self, nominal):
        return 0.005

    def ceiling(self, nominal):
        return 0.4

    @staticmethod
    def _phases(c) -> np.ndarray:
        """(3,) relative error of each phase at rated current."""
        return sum((value * np.array(PHASES[key.pattern]) for key, value in c.items()), np.zeros(3))

    def size(self, c, nominal):
        return float(np.max(np.abs(self._phases(c))))

    def corrected(self, view, c):
        return view.without_current(sum(c.get(key, 0.0) * error for key, error in _errors(view).items()))

    def estimates(self, c, covariance, nominal):
        phases = self._phases(c)
        worst = int(np.argmax(np.abs(phases)))
        weights = np.array([PHASES[key.pattern][worst] for key in c])
        spread = float(np.sqrt(max(weights @ covariance @ weights, 0.0)))
        return {"bend": Estimate(float(phases[worst]), spread, "1")}


EFFECT = CurrentBend(
    name="current_bend",
    title="nonlinear current sensors near full scale",
    clause="the current sensors were nonlinear towards full scale, as with a saturating core",
    equation="i_measured = i + b i^3, b of each phase",
    signature="a sum of the phase currents that follows their third power; order 0 as for a saturation, and order 6",
    separated_by="a second current sensor at full scale; the sum of three measured currents",
    plausible={"bend": (-0.25, 0.25)},  # beyond it a sensor clips, which a check finds
    otherwise="the sensors clip",
    parameters=(Parameter("bend", "1", "relative error at rated current of the worst phase", "bend"),),
    needs=("harmonics", "current"),
    shows_at=Orders((0.0, 2.0, 6.0)),
)
