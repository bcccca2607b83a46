"""Winding resistance other than the nameplate's: u = R i."""

from fluxproof.diagnosis.effect import DOUBT, Effect, Parameter, one, sigma, voltage


class Resistance(Effect):
    def core(self, view):
        return {"delta_r": voltage(view.i_mid)}

    def free(self, view):
        # Skin effect: more ohms at speed.
        return {"skin": voltage(view.i_mid * (view.omega_mid / view.top_speed) ** 2)}

    def possible(self, c, covariance, nominal):
        # Ohms grow with the frequency, they do not fade.
        return c.get("skin", 0.0) >= -DOUBT * sigma(covariance, len(c) - 1)

    def floor(self, nominal):
        return 0.01 * nominal.machine.resistance_ohm

    def ceiling(self, nominal):
        return 3.0 * nominal.machine.resistance_ohm

    def estimates(self, c, covariance, nominal):
        return one("resistance_ohm", "ohm", nominal.machine.resistance_ohm + c["delta_r"], sigma(covariance))

    def plant(self, c, nominal):
        return {"machine.resistance_ohm": nominal.machine.resistance_ohm + c["delta_r"]}


EFFECT = Resistance(
    name="resistance",
    title="winding resistance differs from the nameplate",
    equation="u_dq = (R + delta_r) i_dq",
    signature="order 0, in proportion to the current, at every speed, standstill included",
    confounders=("iron_loss", "magnet_flux", "dead_time", "resistance_temperature"),
    separated_by="low speed and three loads; a reversal of i_q against the magnets, several currents for the inverter",
    parameters=(Parameter("resistance_ohm", "ohm", "per phase, at the recording's temperature"),),
)
