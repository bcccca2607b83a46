# SPDX-License-Identifier: BSD-3-Clause
"""Unequal phase resistances."""

import numpy as np

from fluxproof.diagnosis.balance.curves import course
from fluxproof.diagnosis.catalogue.resistance import to_true_resistance
from fluxproof.diagnosis.effects import Described, FreeCurve, Orders, Parameter, Relative, voltage
from fluxproof.diagnosis.ground.result import Estimate
from fluxproof.plant.transforms import PATTERNS


class PhaseResistanceAsymmetry(FreeCurve, Relative, Described):
    def core(self, view):
        i_abc = view.phases(view.i_mid)
        r = view.machine.resistance_ohm
        return {name: voltage(view.from_phases(r * np.array(w) * i_abc)) for name, w in PATTERNS.items()}

    def free(self, view):
        fade = course(view)[:, :, None]
        i_abc, r = view.phases(view.i_mid), view.machine.resistance_ohm
        return {f"{k}_course": voltage(view.from_phases(fade * r * np.array(w) * i_abc)) for k, w in PATTERNS.items()}

    def floor(self, nominal):
        return 0.01

    def ceiling(self, nominal):
        return 2.0

    def size(self, c, nominal):
        return float(np.hypot(c["alpha"], c["beta"]))

    @staticmethod
    def _phases(c) -> np.ndarray:
        return sum((c[name] * np.array(w) for name, w in PATTERNS.items()), np.zeros(3))

    def estimates(self, c, covariance, nominal):
        out = {}
        for k, phase in enumerate("abc"):
            weights = np.array([PATTERNS[name][k] if name in PATTERNS else 0.0 for name in c])
            spread = float(np.sqrt(max(weights @ covariance @ weights, 0.0)))
            out[f"asymmetry_{phase}"] = Estimate(float(self._phases(c)[k]), spread, "1")
        return out

    def relative(self, c, nominal):
        return to_true_resistance(c, nominal)

    def given(self, view, plant):
        shares = np.array(plant.machine.phase_resistance_asymmetry)
        r = view.machine.resistance_ohm
        return voltage(view.from_phases(r * shares * view.phases(view.i_mid))) if shares.any() else {}

    def plant(self, c, nominal):
        return {"machine.phase_resistance_asymmetry": [float(v) for v in self._phases(c)]}


EFFECT = PhaseResistanceAsymmetry(
    name="phase_resistance_asymmetry",
    title="unequal phase resistances",
    equation="u_x = R (1 + a_x) i_x, sum of a_x = 0",
    signature="order 2 in dq, proportional to current, independent of speed",
    separated_by="standstill and speed: a sensor error also follows omega L i; the sum of three measured currents",
    parameters=tuple(Parameter(f"asymmetry_{x}", "1", f"phase {x}, relative to the mean", f"phase {x}") for x in "abc"),
    plausible={f"asymmetry_{x}": (-0.3, 0.3) for x in "abc"},
    otherwise="a loose contact or a broken strand in the cable",
    needs=("harmonics", "current"),
    shows_at=Orders((2.0,)),
)
