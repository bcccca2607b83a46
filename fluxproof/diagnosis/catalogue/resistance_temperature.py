# SPDX-License-Identifier: BSD-3-Clause
"""Warming winding: R (1 + alpha (T - T_ref)) with the measured temperature, or a free drift over time without one."""

import numpy as np

from fluxproof.diagnosis.balance.curves import BENDS, COURSE_KNOTS, course, courses, known_temperature, reference_c
from fluxproof.diagnosis.catalogue.resistance import to_true_resistance
from fluxproof.diagnosis.effects import DOUBT, Drift, FreeCurve, Parameter, Relative, one, sigma, voltage

COPPER = 0.0039  # 1/K
BEHIND = 0.05  # of the recording: by how much a sensor usually is behind the winding


def _later(view):
    """(b,) by how much the sensor reads more a little later [K]."""
    order = np.argsort(view.course, kind="stable")
    return np.interp(view.course + BEHIND, view.course[order], view.temp[order]) - view.temp


def _change(c, by_alpha):
    """Largest change since the start [ohm]; by_alpha: that of a coefficient of 1/K [ohm K]."""
    drift = c.get("drift", 0.0) * COURSE_KNOTS + by_alpha * abs(c.get("alpha", 0.0))
    drift[1:-1] += [c.get(f"course_{k}", 0.0) for k in range(BENDS)]
    return float(np.max(np.abs(drift)))


class ResistanceTemperature(FreeCurve, Drift, Relative):
    drift_of = "resistance"

    def expected(self, view):
        """A winding that warms has another resistance; where the drive has no coefficient, it is left out."""
        if not known_temperature(view) or view.machine.resistance_temp_coeff_per_k:
            return False
        change = COPPER * float(np.ptp(view.temp)) * view.machine.resistance_ohm
        return change >= self.floor(view.nominal)

    def core(self, view):
        if known_temperature(view):
            rise = view.machine.resistance_ohm * (view.temp - reference_c(view.nominal))
            return {"alpha": voltage(view.i_mid * rise[:, None])}
        return {"drift": voltage(view.i_mid * course(view))}

    def free(self, view):
        out = {f"course_{k}": voltage(view.i_mid * c[:, None]) for k, c in enumerate(courses(view)[:-1])}
        if known_temperature(view):
            out["ahead"] = voltage(view.i_mid * view.machine.resistance_ohm * _later(view)[:, None])
        return out

    def curve_scale(self, key, cores, nominal):
        # Of the course [ohm], also if the formula has a temperature coefficient.
        return cores["alpha"] if key == "ahead" else self.floor(nominal)

    def possible(self, c, covariance, nominal):
        # A metal's resistance rises with its temperature.
        return c.get("alpha", 0.0) >= -DOUBT * sigma(covariance, list(c).index("alpha") if "alpha" in c else 0)

    def floor(self, nominal):
        return 0.015 * nominal.machine.resistance_ohm

    def ceiling(self, nominal):
        return 3.0 * nominal.machine.resistance_ohm

    def size(self, c, nominal):
        """Change of resistance over the recording, or by 30 K [ohm]."""
        return _change(c, 30.0 * nominal.machine.resistance_ohm)

    def moved(self, c, view):
        """Change of resistance over the recording [ohm]."""
        warmed = float(np.ptp(view.temp)) if "alpha" in c else 0.0
        return _change(c, warmed * view.machine.resistance_ohm)

    def relative(self, c, nominal):
        return to_true_resistance(c, nominal) if "alpha" in c["resistance_temperature"] else 1.0

    def estimates(self, c, covariance, nominal):
        if "alpha" in c:
            return one("resistance_temp_coeff_per_k", "1/K", c["alpha"], sigma(covariance))
        return one("resistance_drift_ohm", "ohm", c["drift"], sigma(covariance))

    def plant(self, c, nominal):
        return {"machine.resistance_temp_coeff_per_k": c["alpha"]} if "alpha" in c else {}


EFFECT = ResistanceTemperature(
    name="resistance_temperature",
    title="temperature drift of the winding resistance",
    equation="u_dq = R (1 + alpha (T - T_ref)) i_dq",
    signature="order 0, proportional to current times temperature rise",
    separated_by="a thermocouple; a load step while hot; standstill with current, cold and hot machine",
    parameters=(
        Parameter("resistance_temp_coeff_per_k", "1/K", "copper: 0.0039; needs temp_winding", "coefficient"),
        Parameter("resistance_drift_ohm", "ohm", "from start to end, if no temperature was recorded", "change"),
    ),
    plausible={
        "resistance_temp_coeff_per_k": (0.003, 0.005),
        "resistance_drift_ohm": (-0.2, 0.6, "machine.resistance_ohm"),
    },
    otherwise="copper has 0.39 %/K: something else warms up, or the sensor is not at the winding",
)
