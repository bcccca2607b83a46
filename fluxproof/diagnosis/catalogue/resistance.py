# SPDX-License-Identifier: BSD-3-Clause
"""Winding resistance that differs from the nameplate: u = R i."""

from fluxproof.diagnosis.effects import DOUBT, Constant, FreeCurve, Parameter, Spread, one, sigma, voltage


def to_true_resistance(c, nominal) -> float:
    """Nominal resistance over the resistance found, for effects relative to it; c: {effect: coefficients}."""
    r = nominal.machine.resistance_ohm
    return r / max(r + c.get("resistance", {}).get("delta_r", 0.0), 0.1 * r)


class Resistance(FreeCurve, Constant, Spread):
    rescales = ("resistance_ohm",)

    def core(self, view):
        return {"delta_r": voltage(view.i_mid)}

    def free(self, view):
        # Skin effect: the resistance grows with frequency.
        return {"skin": voltage(view.i_mid * (view.omega_mid / view.top_speed) ** 2)}

    def possible(self, c, covariance, nominal):
        # A resistance grows with the frequency and does not decrease.
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
    title="winding resistance off the nameplate",
    equation="u_dq = (R + delta_r) i_dq",
    signature="order 0, proportional to current, at every speed including standstill",
    separated_by="low speed and three loads; i_q reversed (against magnet_flux), several currents (against dead_time)",
    parameters=(Parameter("resistance_ohm", "ohm", "per phase, at the temperature of the recording", "resistance"),),
    plausible={"resistance_ohm": (0.33, 3.0, "machine.resistance_ohm")},
    otherwise="a resistance between two terminals is twice that of a phase; cables and contacts add to the winding",
)
