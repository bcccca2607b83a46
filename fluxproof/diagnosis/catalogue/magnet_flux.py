# SPDX-License-Identifier: BSD-3-Clause
"""Magnet flux linkage that differs from the nameplate: omega psi_m on the q axis."""

import numpy as np

from fluxproof.diagnosis.balance.curves import course
from fluxproof.diagnosis.effects import DOUBT, Constant, FluxEffect, Parameter, Spread, one, sigma


class MagnetFlux(FluxEffect, Constant, Spread):
    rescales = ("magnet_flux_wb",)
    curve = 0.1  # a part of lost flux recovers; more is a drift

    def core_psi(self, view):
        return {"delta_psi_m": np.ones_like(view.i)}

    def free_psi(self, view):
        return {"recovery": np.ones_like(view.i) * course(view)}

    def possible(self, c, covariance, nominal):
        """Lost flux may recover, but not fall further: that is a warming magnet, unless it is too little to matter."""
        key, lost = "recovery", c["delta_psi_m"]
        if not c.get(key):
            return True
        return c[key] * np.sign(lost) <= DOUBT * sigma(covariance, list(c).index(key)) + self.floor(nominal)

    def floor(self, nominal):
        return 0.003 * nominal.machine.magnet_flux_wb

    def ceiling(self, nominal):
        return 0.6 * nominal.machine.magnet_flux_wb

    def estimates(self, c, covariance, nominal):
        return one("magnet_flux_wb", "Wb", nominal.machine.magnet_flux_wb + c["delta_psi_m"], sigma(covariance))

    def plant(self, c, nominal):
        return {"machine.magnet_flux_wb": nominal.machine.magnet_flux_wb + c["delta_psi_m"]}


EFFECT = MagnetFlux(
    name="magnet_flux",
    title="magnet flux off the nameplate",
    equation="psi_d = L_d i_d + psi_m + delta_psi_m",
    signature="order 0 on the q axis, proportional to speed, at every current including zero",
    separated_by="three speeds; rotation at zero current",
    parameters=(Parameter("magnet_flux_wb", "Wb", "peak, per phase", "flux linkage"),),
    plausible={"magnet_flux_wb": (0.5, 2.0, "machine.magnet_flux_wb")},
    otherwise="a drive file with the value between two terminals (1.73 times) or the rms value (0.71), or lost magnets",
)
