"""Unequal gains of the current sensors."""

import numpy as np

from fluxproof.diagnosis.effects.effect import DOUBT, Effect, Parameter, current_error, phase_error, sigma
from fluxproof.diagnosis.result import Estimate

# Gains of two sensors that differ by g cause a harmonic of 0.58 g and a rotation of 0.29 g; twice that is allowed.
MOST_TURN = 1 / 3
PATTERNS = {"alpha": (2 / 3, -1 / 3, -1 / 3), "beta": (0.0, 3**-0.5, -(3**-0.5))}


def gain_column(view, weights):
    """Column of relative gain errors with the given weights of the three phases."""
    return phase_error(view, view.phases(view.i) * np.array(weights))


class CurrentGain(Effect):
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

    def estimates(self, c, covariance, nominal):
        names = list(c)
        out = {}
        for k, phase in enumerate("abc"):
            weights = np.array([PATTERNS[n][k] if n in PATTERNS else 1.0 if n == "common" else 0.0 for n in names])
            spread = float(np.sqrt(max(weights @ covariance @ weights, 0.0)))
            out[f"gain_{phase}"] = Estimate(float(self._gains(c)[k]), spread, "1")
        return out

    def plant(self, c, nominal):
        return {"sensors.current_gain_error": [float(v) for v in self._gains(c)]}


EFFECT = CurrentGain(
    name="current_gain",
    title="unequal gains of the current sensors",
    equation="i_measured = (1 + g_abc) i",
    signature="order 2 in dq, in proportion to the current; phase currents that do not sum to zero",
    confounders=("phase_resistance_asymmetry", "inductance_d", "current_scale"),
    separated_by="a sweep of the speed: the sensors' error also follows omega L i; the sum of three measured currents",
    parameters=tuple(Parameter(f"gain_{x}", "1", f"relative error of phase {x}", f"phase {x}") for x in "abc"),
    shows_at=(2.0,),
    plausible={f"gain_{x}": (-0.1, 0.1) for x in "abc"},
    otherwise="a shunt of another value, a wrong scale of one column, or a converter that clips",
    corrects=True,
    stays="an error of measurement is in the recording itself; the trims act from the next one on",
    needs=("harmonics", "current"),
)
