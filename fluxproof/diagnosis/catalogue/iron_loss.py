# SPDX-License-Identifier: BSD-3-Clause
"""Iron loss: a current j omega psi / R_fe in parallel with the magnetising current; R_fe may depend on frequency.

The loss current may also lag by a time, as eddy currents do, and then weakens the flux in proportion to omega^2.
"""

import numpy as np

from fluxproof.diagnosis.effects import DOUBT, Described, FreeCurve, LostFlux, Parameter, one, sigma, torque_of
from fluxproof.plant.transforms import linear_limit

LAG_S = 1e-4  # time in which eddy currents build up in a lamination of 0.3 mm


def _speeds(view):
    """Frequency functions (b, m+1) [rad/s] of the loss current: linear, saturating, squared, its lag."""
    top = max(view.top_speed, 1.0)
    # A sign function would turn the noise of the speed at standstill into the full hysteresis current.
    steady = np.broadcast_to(view.omega.mean(axis=1, keepdims=True), view.omega.shape)
    return {
        "g_fe": view.omega,
        "g_hysteresis": steady / np.sqrt((steady / top) ** 2 + 0.02**2),
        "g_eddy": view.omega * np.abs(view.omega) / top,
        "g_lag": -1j * view.omega**2 * LAG_S,
    }


def _conducting(c):
    """(k,) 1 for the coefficients that are conductances, 0 for the lag, in their order."""
    return np.array([float(key != "g_lag") for key in c])


def _loss(view, omega):
    """Terms of the loss current j omega psi, per siemens."""
    i_fe = 1j * omega * view.psi
    psi = -view.inductances(i_fe)
    return {"u": view.flux(psi), "torque": torque_of(view, psi, view.i) - torque_of(view, view.psi, i_fe)}


class IronLoss(FreeCurve, LostFlux, Described):
    def core(self, view):
        speeds = _speeds(view)
        return {key: _loss(view, speeds[key]) for key in ("g_fe", "g_hysteresis")}

    def free(self, view):
        speeds = _speeds(view)
        return {key: _loss(view, speeds[key]) for key in ("g_eddy", "g_lag")}

    def possible(self, c, covariance, nominal):
        """Iron consumes power, and a current follows its cause."""
        late = list(c).index("g_lag") if "g_lag" in c else None
        return self._conductance(c) >= 0.0 and (late is None or c["g_lag"] >= -DOUBT * sigma(covariance, late))

    def lost_flux(self, view, c):
        """Missing flux linkage (b, m+1) complex dq [Wb]: the loss current does not magnetise.

        The loss current is proportional to the remaining flux, so that this includes terms beyond first order.
        """
        speeds = _speeds(view)
        conductance = 1j * sum(value * speeds[key] for key, value in c.items())
        first = view.inductances(conductance * view.psi)
        return -view.inductances(conductance * (view.psi - first))

    def floor(self, nominal):
        m = nominal.machine
        return 0.002 * m.rated_current_a / self._rated_emf(nominal)

    def too_large(self, c, view):
        """Whether the loss current at the highest recorded speed exceeds half the rated current."""
        emf = view.top_speed * view.machine.magnet_flux_wb
        return self.size(c, view.nominal) * emf > 0.5 * view.machine.rated_current_a

    @staticmethod
    def _rated_emf(nominal):
        return linear_limit(nominal.inverter.dc_bus_v)

    @staticmethod
    def _conductance(c):
        """At the highest recorded speed [S]."""
        return float(_conducting(c) @ list(c.values()))

    def size(self, c, nominal):
        return abs(self._conductance(c))

    def estimates(self, c, covariance, nominal):
        g, weights = self._conductance(c), _conducting(c)
        spread = float(np.sqrt(max(weights @ covariance @ weights, 0.0)))
        g = g if abs(g) > 1e-12 else 1e-12
        return one("iron_resistance_ohm", "ohm", 1.0 / g, spread / g**2)

    def given(self, view, plant):
        g = plant.machine.iron_conductance_s
        if not g:
            return {}
        return {**_loss(view, g * view.omega), "u": view.flux(self.lost_flux(view, {"g_fe": g}))}

    def plant(self, c, nominal):
        return {"machine.iron_conductance_s": max(0.0, self._conductance(c))}


EFFECT = IronLoss(
    name="iron_loss",
    title="iron loss",
    equation="i = i_m + j omega psi / R_fe",
    signature="order 0: omega^2 L_q psi / R_fe on the d axis, even in speed, and a drag torque",
    separated_by="load: omega^2 i_q on the q axis; a shifted sampling trigger; low speed for hysteresis",
    parameters=(
        Parameter("iron_resistance_ohm", "ohm", "parallel to the EMF, at the highest speed", "loss resistance"),
    ),
    needs=("angle",),
)
