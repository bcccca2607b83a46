"""Currents are sampled tau after the middle of the zero vector, in which the EMF gives them a slope."""

import numpy as np

from fluxproof.diagnosis.effects.effect import Effect, Parameter, angle_error, current_error, one, zero_vector_slope


def skewed(view):
    """Column of currents that are sampled off the valley, per second of skew."""
    return current_error(view, zero_vector_slope(view))


def unskewed(view, tau):
    """The view with the currents corrected for sampling tau [s] after the valley."""
    error = tau * zero_vector_slope(view)
    return view.replace(i=view.i - error, i_raw=view.i_raw - view.stator(error)) if tau else view


class SamplingSkew(Effect):
    def core(self, view):
        # Either of the two is latched off the valley: if both are, the voltage is early.
        return {"tau": skewed(view), "angle": angle_error(view, view.omega)}

    def size(self, c, nominal):
        return max(abs(v) for v in c.values())

    def floor(self, nominal):
        return 0.0012 * nominal.sample_time_s

    def ceiling(self, nominal):
        return 0.3 * nominal.sample_time_s

    def corrected(self, view, c):
        return unskewed(view.turned(c.get("angle", 0.0) * view.omega), c["tau"])

    def estimates(self, c, covariance, nominal):
        # Currents relative to the angle, whichever of the two is latched off the valley.
        weights = np.array([{"tau": 1.0, "angle": -1.0}[name] for name in c])
        spread = np.sqrt(max(weights @ covariance @ weights, 0.0))
        return one("skew_s", "s", c["tau"] - c.get("angle", 0.0), spread)

    def plant(self, c, nominal):
        return {"timing.sampling_skew_s": c["tau"]}


EFFECT = SamplingSkew(
    name="sampling_skew",
    title="shifted sampling instant of the currents",
    equation="i_measured = i(t + tau), di/dt = -(R i + j omega psi_m) / L",
    signature="order 0: omega^2 psi_m tau on the d axis, equivalent to an iron loss of R_fe = -L_q / tau",
    confounders=("iron_loss", "delay", "inductance_q"),
    one_of=(("tau",), ("angle",)),
    separated_by="load (an iron loss also follows omega^2 i_q); a deliberately shifted sampling trigger",
    parameters=(Parameter("skew_s", "s", "of the currents relative to the angle; positive: late", "late by"),),
    corrects=True,
    stays="an error in time is in the recording itself",
    corrected_last=True,
    needs=("harmonics", "inverter"),
)
