"""The duties take effect later than assumed: the voltage is that of an earlier row."""

import numpy as np

from fluxproof.diagnosis.balance.curves import parabola
from fluxproof.diagnosis.effects.effect import Effect, Parameter, one, sigma, voltage

MOST = 1.2  # periods: beyond one period the interpolation continues linearly, so that the iteration can return


def _smooth(view):
    """Stator-frame voltage of the intervals -1 .. m without noise, (b, m+2) [V]: a parabola in dq over the block.

    A current loop returns the converters' noise in the recorded voltage.  A column of the raw voltage would therefore
    contain the noise of the misfit, and moving the raw voltage would filter it.
    """
    turn = np.exp(1j * view.interval_angle)
    return parabola(view.u * np.conj(turn)) * turn


def _moved(view, share):
    """Change of the voltage (b, m+2) [V] if it is taken ``share`` periods earlier."""
    u, change = _smooth(view), np.zeros_like(view.u)
    if share >= 0.0:
        change[:, 1:] = share * (u[:, :-1] - u[:, 1:])
    else:
        change[:, :-1] = -share * (u[:, 1:] - u[:, :-1])
    return change


class Delay(Effect):
    def core(self, view):
        return {"tau": voltage(-view.to_dq(_moved(view, 1.0)[:, 1:-1]) / view.sample_time_s)}

    def floor(self, nominal):
        return 0.006 * nominal.sample_time_s

    def ceiling(self, nominal):
        return 2.5 * nominal.sample_time_s

    def corrected(self, view, c):
        share = float(np.clip(c["tau"] / view.sample_time_s, -MOST, MOST))
        return view.replace(u=view.u + _moved(view, share))

    def estimates(self, c, covariance, nominal):
        return one("delay_s", "s", c["tau"], sigma(covariance))

    def plant(self, c, nominal):
        return {"timing.delay_s": c["tau"]}


EFFECT = Delay(
    name="delay",
    title="delay of the voltage",
    equation="u(t) = u_recorded(t - tau)",
    signature="order 0: the whole voltage vector rotated by omega tau",
    confounders=("encoder_offset", "sampling_skew", "iron_loss"),
    separated_by="two speeds, both directions; load at each; a step",
    parameters=(Parameter("delay_s", "s", "beyond duty_applied_after_samples", "later by"),),
    corrects=True,
    stays="an error in time is in the recording itself",
    needs=("samples", "inverter"),
)
