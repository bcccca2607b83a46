"""The magnets warm: omega psi_m (1 + alpha_m (T_m - T_ref)), a slow course, as nobody measures a rotor."""

import numpy as np

from diagnosis.catalogue.effect import FluxEffect, Parameter, one, sigma
from diagnosis.curves import courses, known_temperature, reference_c


class MagnetTemperature(FluxEffect):
    def core_psi(self, view):
        one_wb = np.ones_like(view.i)
        if known_temperature(view):
            rise = view.machine.magnet_flux_wb * (view.temp - reference_c(view.nominal))
            return {"alpha_m": one_wb * rise[:, None]}
        return {"drift": one_wb * (view.t / max(view.span_s, 1e-9))[:, None]}

    def free_psi(self, view):
        one_wb = np.ones_like(view.i)
        return {f"course_{k}": one_wb * c[:, None] for k, c in enumerate(courses(view)[:-1])}

    def floor(self, nominal):
        return 0.004 * nominal.machine.magnet_flux_wb

    def size(self, c, nominal):
        own = abs(c.get("alpha_m", 0.0)) * nominal.machine.magnet_flux_wb * 20.0 + abs(c.get("drift", 0.0))
        return max(own, *(abs(v) for k, v in c.items() if k.startswith("course")), 0.0)

    def estimates(self, c, covariance, nominal):
        if "alpha_m" in c:
            return one("magnet_temp_coeff_per_k", "1/K", c["alpha_m"], sigma(covariance))
        return one("magnet_flux_drift_wb", "Wb", c["drift"], sigma(covariance))

    def plant(self, c, nominal):
        return {"machine.magnet_temp_coeff_per_k": c["alpha_m"]} if "alpha_m" in c else {}


EFFECT = MagnetTemperature(
    name="magnet_temperature",
    title="flux linkage of the magnets changes with temperature",
    equation="psi_d = L_d i_d + psi_m (1 + alpha_m (T_m - T_ref))",
    signature="order 0 on the q axis, in proportion to the speed, drifting over time",
    confounders=("magnet_flux", "resistance_temperature"),
    separated_by="hot and cold, at two speeds and without current",
    parameters=(
        Parameter("magnet_temp_coeff_per_k", "1/K", "NdFeB: about -0.001; the winding's temperature stands for the magnets'"),
        Parameter("magnet_flux_drift_wb", "Wb", "from start to end, where no temperature was recorded"),
    ),
    absorbs=("magnet_flux",),
)
