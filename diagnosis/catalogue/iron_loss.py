"""Iron loss: a current j omega psi / R_fe in parallel with the magnetising current; R_fe may depend on frequency."""

import numpy as np

from fluxproof.diagnosis.effects.effect import Effect, Parameter, one, torque_of


def _speeds(view):
    """Frequency functions (b, m+1) [rad/s] of the loss current: linear, saturating, squared."""
    top = max(view.top_speed, 1.0)
    # A sign function would turn the noise of the speed at standstill into the full hysteresis current.
    steady = np.broadcast_to(view.omega.mean(axis=1, keepdims=True), view.omega.shape)
    return {
        "g_fe": view.omega,
        "g_hysteresis": steady / np.sqrt((steady / top) ** 2 + 0.02**2),
        "g_eddy": view.omega * np.abs(view.omega) / top,
    }


def _loss(view, omega):
    """Terms of the loss current j omega psi, per siemens."""
    i_fe = 1j * omega * view.psi
    psi = -view.inductances(i_fe)
    return {"u": view.flux(psi), "torque": torque_of(view, psi, view.i) - torque_of(view, view.psi, i_fe)}


class IronLoss(Effect):
    def core(self, view):
        speeds = _speeds(view)
        return {key: _loss(view, speeds[key]) for key in ("g_fe", "g_hysteresis")}

    def free(self, view):
        return {"g_eddy": _loss(view, _speeds(view)["g_eddy"])}

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
        return nominal.inverter.dc_bus_v / np.sqrt(3)

    def size(self, c, nominal):
        return abs(sum(c.values()))

    def estimates(self, c, covariance, nominal):
        g = sum(c.values())
        every = np.ones(len(c))
        spread = float(np.sqrt(max(every @ covariance @ every, 0.0)))
        g = g if abs(g) > 1e-12 else 1e-12
        return one("iron_resistance_ohm", "ohm", 1.0 / g, spread / g**2)

    def given(self, view, plant):
        g = plant.machine.iron_conductance_s
        if not g:
            return {}
        return {**_loss(view, g * view.omega), "u": view.flux(self.lost_flux(view, {"g_fe": g}))}

    def plant(self, c, nominal):
        return {"machine.iron_conductance_s": max(0.0, sum(c.values()))}


EFFECT = IronLoss(
    name="iron_loss",
    title="iron loss",
    equation="i = i_m + j omega psi / R_fe",
    signature="order 0: omega^2 L_q psi / R_fe on the d axis, even in speed, and a drag torque",
    confounders=("sampling_skew", "inductance_q", "resistance", "delay"),
    separated_by="load: omega^2 i_q on the q axis; a shifted sampling trigger; low speed for hysteresis",
    parameters=(
        Parameter("iron_resistance_ohm", "ohm", "parallel to the EMF, at the highest speed", "loss resistance"),
    ),
    positive=True,
    takes_flux=True,
    needs=("angle",),
)
