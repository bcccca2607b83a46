# SPDX-License-Identifier: BSD-3-Clause
"""Unequal gains of the current sensors."""

import numpy as np

from fluxproof.diagnosis.effects import (
    DOUBT,
    FreeCurve,
    MeasurementError,
    Orders,
    Parameter,
    current_error,
    phase_error,
    sigma,
)
from fluxproof.diagnosis.ground.result import Estimate
from fluxproof.plant.transforms import PATTERNS

# Gains of two sensors that differ by g cause a harmonic of 0.58 g and a rotation of 0.29 g; twice that is allowed.
MOST_TURN = 1 / 3
# Coefficients of gains of +1/2 and -1/2 of two sensors whose third current is computed, i_c = -i_a - i_b; the part of
# the coefficients by which they may differ from that, and of its rotation, which three sensors do not have.
PAIR = {"alpha": 1.5, "beta": -(0.75**0.5), "turn": 12**-0.5}
UNLIKE_PAIR, TURNED = 0.2, 0.5


def gain_column(view, weights):
    """Column of relative gain errors with the given weights of the three phases."""
    return phase_error(view, view.phases(view.i) * np.array(weights))


class CurrentGain(MeasurementError, FreeCurve):
    def core(self, view):
        return {name: gain_column(view, w) for name, w in PATTERNS.items()}

    def free(self, view):
        # With two sensors and i_c = -i_a - i_b the third phase has the errors of both, which also rotates the vector.
        return {"common": gain_column(view, (1.0, 1.0, 1.0)), "turn": current_error(view, 1j * view.i)}

    def floor(self, nominal):
        return 0.0025

    def ceiling(self, nominal):
        return 0.5

    def size(self, c, nominal):
        return float(np.hypot(c["alpha"], c["beta"]))

    def possible(self, c, covariance, nominal):
        """Nearly equal gains do not rotate the vector: a scale error or a rotation alone is another effect."""
        if not c.get("turn"):
            return True
        return abs(c["turn"]) <= MOST_TURN * self.size(c, nominal) + DOUBT * sigma(covariance, list(c).index("turn"))

    @staticmethod
    def _gains(c):
        return sum(c[name] * np.array(w) for name, w in PATTERNS.items()) + c.get("common", 0.0)

    def corrected(self, view, c):
        i_abc = view.phases(view.i)
        error = i_abc * (self._gains(c) / (1.0 + self._gains(c)))
        if c.get("turn"):
            error = error + view.phases(1j * c["turn"] * view.i)
        return view.without_current(error, raw_gain=1.0 + self._gains(c), turn=c.get("turn", 0.0))

    @staticmethod
    def _of_sensors(c) -> dict[str, dict[str, float]]:
        """{phase: weights of the coefficients in the gain of its sensor}; two phases if the third was computed."""
        seen, pair = (np.array([weights.get(n, 0.0) for n in PAIR]) for weights in (c, PAIR))
        differ = pair @ seen / (pair @ pair)
        turned = bool(differ) and c.get("turn", 0.0) / differ >= TURNED * PAIR["turn"]
        if turned and np.linalg.norm(seen - differ * pair) < UNLIKE_PAIR * np.linalg.norm(seen):
            half = {n: 0.5 * weight / (pair @ pair) for n, weight in PAIR.items()}
            return {"a": {"common": 1.0} | half, "b": {"common": 1.0} | {n: -w for n, w in half.items()}}
        return {x: {"common": 1.0} | {n: w[k] for n, w in PATTERNS.items()} for k, x in enumerate("abc")}

    def estimates(self, c, covariance, nominal):
        out = {}
        for phase, of in self._of_sensors(c).items():
            weights = np.array([of.get(n, 0.0) for n in c])
            spread = float(np.sqrt(max(weights @ covariance @ weights, 0.0)))
            out[f"gain_{phase}"] = Estimate(float(weights @ np.array(list(c.values()))), spread, "1")
        return out

    def plant(self, c, nominal):
        sensors = self._of_sensors(c)
        gains = {x: sum(weight * c.get(n, 0.0) for n, weight in of.items()) for x, of in sensors.items()}
        return {"sensors.current_gain_error": [float(gains.get(x, 0.0)) for x in "abc"]}


EFFECT = CurrentGain(
    name="current_gain",
    title="unequal gains of the current sensors",
    equation="i_measured = (1 + g_abc) i",
    signature="order 2 in dq, in proportion to the current; phase currents that do not sum to zero",
    separated_by="a sweep of the speed: the sensors' error also follows omega L i; the sum of three measured currents",
    parameters=tuple(Parameter(f"gain_{x}", "1", f"relative error of phase {x}", f"phase {x}") for x in "abc"),
    plausible={f"gain_{x}": (-0.1, 0.1) for x in "abc"},
    otherwise="a shunt of another value, a wrong scale of one column, or a converter that clips",
    needs=("harmonics", "current"),
    shows_at=Orders((2.0,)),
)
