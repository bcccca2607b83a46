# SPDX-License-Identifier: BSD-3-Clause
"""Voltage errors of single inverter legs, constant over the turn, as of drivers with different delays."""

import numpy as np

from fluxproof.diagnosis.effects import Effect, Orders, Parameter, voltage
from fluxproof.diagnosis.ground.result import Estimate
from fluxproof.plant.transforms import PATTERNS

LEGS = {name: np.array(weights) for name, weights in PATTERNS.items()}


class LegVoltage(Effect):
    def core(self, view):
        share = view.u_dc / view.nominal.inverter.dc_bus_v
        return {name: voltage(view.from_phases(share[..., None] * weights)) for name, weights in LEGS.items()}

    def floor(self, nominal):
        return 5e-4 * nominal.inverter.dc_bus_v

    def ceiling(self, nominal):
        return 0.1 * nominal.inverter.dc_bus_v

    def size(self, c, nominal):
        return float(np.hypot(c["alpha"], c["beta"]))

    def estimates(self, c, covariance, nominal):
        value = self.size(c, nominal)
        pair = np.array([c["alpha"], c["beta"]])
        spread = lambda weights: float(np.sqrt(max(weights @ covariance[:2, :2] @ weights, 0.0)))  # noqa: E731
        out = {"volts": Estimate(value, spread(pair / max(value, 1e-12)), "V")}
        for k, leg in enumerate("abc"):
            weights = np.array([LEGS["alpha"][k], LEGS["beta"][k]])
            out[f"leg_{leg}"] = Estimate(float(weights @ pair), spread(weights), "V")
        return out


EFFECT = LegVoltage(
    name="leg_voltage",
    title="unequal voltage errors of the legs",
    clause="the legs of the inverter had different voltage errors, as with unequal gate-driver delays",
    equation="u = u_recorded - e_abc, constant in the stator frame, of each leg against the mean",
    signature="order 1 in dq, the same at every speed and current",
    separated_by="two speeds: offsets of the sensors also appear proportional to the speed",
    plausible={"volts": (0.0, 0.03, "inverter.dc_bus_v")},  # as a dead time: legs differ by less than a loss
    otherwise="a gate driver is broken, or a sensor has an offset",
    parameters=(
        Parameter("volts", "V", "difference of the legs", "difference"),
        *(Parameter(f"leg_{x}", "V", f"leg {x} against the mean of the legs", f"leg {x}") for x in "abc"),
    ),
    needs=("harmonics", "inverter"),
    shows_at=Orders((1.0,)),
)
