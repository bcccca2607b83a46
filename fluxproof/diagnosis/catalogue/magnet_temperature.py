# SPDX-License-Identifier: BSD-3-Clause
"""Warming magnets: omega psi_m (1 + alpha_m (T_m - T_ref)), a slow drift, since the rotor temperature is unknown."""

import numpy as np

from fluxproof.diagnosis.balance.curves import BENDS, COURSE_KNOTS, course, courses, step_at_start
from fluxproof.diagnosis.effects import Drift, FluxEffect, Parameter, one, sigma

MOST_AT_ONCE = 4.0  # largest ratio of the step at the start to the later change


class MagnetTemperature(FluxEffect, Drift):
    drift_of = "magnet_flux"

    def core_psi(self, view):
        return {"drift": np.ones_like(view.i) * course(view)}

    def free_psi(self, view):
        return {f"course_{k}": np.ones_like(view.i) * c[:, None] for k, c in enumerate(courses(view)[:-1])}

    def floor(self, nominal):
        return 0.004 * nominal.machine.magnet_flux_wb

    def ceiling(self, nominal):
        return 0.4 * nominal.machine.magnet_flux_wb

    @staticmethod
    def _at_knots(c):
        """Change of flux since the start, at the knots of the course [Wb]."""
        drift = c["drift"] * COURSE_KNOTS
        drift[1:-1] += [c.get(f"course_{k}", 0.0) for k in range(BENDS)]
        return drift

    def size(self, c, nominal):
        """Largest change of flux since the start [Wb]."""
        return float(np.max(np.abs(self._at_knots(c))))

    def possible(self, c, covariance, nominal):
        """Warming takes time: a deviation present almost completely from the start is a wrong constant."""
        later = self._at_knots(c)[1:]
        return abs(step_at_start(c)) <= MOST_AT_ONCE * float(np.max(np.abs(later - later[0])))

    def estimates(self, c, covariance, nominal):
        return one("magnet_flux_drift_wb", "Wb", c["drift"], sigma(covariance))

    def plant(self, c, nominal):
        rise = 20.0  # the plant takes a magnet temperature; the drift is assigned to a rise of 20 K
        return {"machine.magnet_temp_coeff_per_k": c["drift"] / nominal.machine.magnet_flux_wb / rise}


EFFECT = MagnetTemperature(
    name="magnet_temperature",
    title="temperature drift of the magnet flux",
    equation="psi_d = L_d i_d + psi_m (1 + alpha_m (T_m - T_ref))",
    signature="order 0 on the q axis, proportional to speed, drifting over time",
    separated_by="hot and cold machine, at two speeds and at zero current",
    parameters=(
        Parameter("magnet_flux_drift_wb", "Wb", "from start to end; the magnet temperature is not measured", "change"),
    ),
    plausible={"magnet_flux_drift_wb": (-0.25, 0.0, "machine.magnet_flux_wb")},
    otherwise="magnets lose 0.05 to 0.2 % of their flux per kelvin: a sensor drifts, or the machine cooled",
    needs=("time",),
)
