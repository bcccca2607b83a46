"""The duties take effect later than assumed: the voltage is that of an earlier row."""

import numpy as np

from fluxproof.diagnosis.catalogue.sampling_skew import skewed, unskewed
from fluxproof.diagnosis.effect import DOUBT, Effect, Parameter, one, sigma, voltage, within_dead_time

MOST = 1.2  # periods: beyond one period the interpolation continues linearly, so that the iteration can return


class Delay(Effect):
    def core(self, view):
        return {"tau": voltage(view.to_dq(view.u[:, 1:-1] - view.u[:, :-2]) / view.sample_time_s)}

    def free(self, view):
        # If the gates are late as a whole, the converters also sample off the valley.  With enough operating points for
        # two effects this is a separate skew; with fewer it is a free form of the delay.
        return {"off_valley": skewed(view)} if view.lone else {}

    def possible(self, c, covariance, nominal):
        """The sampling is off the valley by no more than the gates are late."""
        off = abs(c.get("off_valley", 0.0))
        return not off or off <= abs(c["tau"]) + DOUBT * sigma(covariance, list(c).index("off_valley"))

    def floor(self, nominal):
        return 0.006 * nominal.sample_time_s

    def overshadowed(self, c, nominal):
        return within_dead_time(c, nominal)

    def ceiling(self, nominal):
        return 2.5 * nominal.sample_time_s

    def corrected(self, view, c):
        share = float(np.clip(c["tau"] / view.sample_time_s, -MOST, MOST))
        u = view.u.copy()
        if share >= 0.0:
            u[:, 1:] = (1.0 - share) * view.u[:, 1:] + share * view.u[:, :-1]
        else:
            u[:, :-1] = (1.0 + share) * view.u[:, :-1] - share * view.u[:, 1:]
        return unskewed(view.replace(u=u), c.get("off_valley", 0.0))

    def estimates(self, c, covariance, nominal):
        return one("delay_s", "s", c["tau"], sigma(covariance))

    def plant(self, c, nominal):
        return {"timing.delay_s": c["tau"]}


EFFECT = Delay(
    name="delay",
    title="the voltage takes effect later than assumed",
    equation="u(t) = u_recorded(t - tau)",
    signature="order 0: the whole voltage vector rotated by omega tau",
    confounders=("encoder_offset", "sampling_skew", "iron_loss"),
    separated_by="two speeds, both directions; load at each; a step",
    parameters=(Parameter("delay_s", "s", "beyond duty_applied_after_samples"),),
    corrects=True,
    needs=("samples", "inverter"),
)
