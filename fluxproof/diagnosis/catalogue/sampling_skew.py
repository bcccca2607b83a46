# SPDX-License-Identifier: BSD-3-Clause
"""Currents and angle are of different instants: the currents off the valley, or an angle that a filter makes late.

Currents that are sampled tau after the middle of the zero vector have the slope that the EMF gives them, and the ripple
of the pulses.  An angle that is late by tau, from an observer, a filter or an older message, turns all dq values by
omega tau.  At operating points, where a late angle follows omega^2 psi tau as a late voltage does, both are forms of
the delay: side by side they led the search of a real saturating machine to a wrong scale of the currents.
"""

import numpy as np

from fluxproof.diagnosis.balance.late_pulses import instant, off_valley
from fluxproof.diagnosis.effects import (
    Alternatives,
    Described,
    FreeCurve,
    MeasurementError,
    Parameter,
    angle_error,
    current_error,
    one,
    zero_vector_slope,
)

TRIED, FINE = np.arange(-12, 13) / 50, 0.001  # periods after the valley
OFF_VALLEY = 0.3  # periods by which currents may be sampled off the valley
NEAR = 0.1  # periods between a skew and that of its ripple
STEP = 0.002  # periods on both sides of an instant, over which the slope of the ripple is taken
RELEVANT_PERIODS = 0.012
ROW = 1.5  # periods by which currents and angle may differ: a column that is written a row later than the others
LATE = 0.5  # rad at the highest speed, by which an angle may be late: a filter's lag that a loop still runs with
RIPPLE = 0.1  # share by which the ripple may be wrong: a filter of the currents rounds it
# Weights of the coefficients in the time by which the currents are later than the angle.
WEIGHTS = {"tau": 1.0, "pulses": 1.0, "shift": 1.0, "filter": 0.0, "angle": -1.0}


def skewed(view):
    """Column of currents that are sampled off the valley, per second of skew."""
    return current_error(view, zero_vector_slope(view))


def _without(view, error):
    return view.replace(i=view.i - error, i_raw=view.i_raw - view.stator(error))


def _seen(view, at):
    """Voltage (b, m) [V] that the samples add to the misfit."""
    return current_error(view, off_valley(view, at))["u"]


def _ripples(view):
    """Current (b, m+1) of the pulses per second of skew: chord up to the instant of the recording, tangent there.

    Operating points have no pulses.
    """
    sampled = view.locked[:, None]
    if not sampled.any():
        return {"pulses": np.zeros_like(view.i), "shift": np.zeros_like(view.i)}
    period = view.sample_time_s
    at = instant(view, "off_valley", TRIED, FINE, _seen)
    step = off_valley(view, at + STEP) - off_valley(view, at - STEP)
    chord = off_valley(view, at) / (at * period or 1.0)
    return {"pulses": chord * sampled, "shift": step / (2.0 * STEP * period) * sampled}


class SamplingSkew(MeasurementError, FreeCurve, Alternatives, Described):
    corrected_last = True
    one_of = (("tau",), ("angle",), ("pulses", "shift", "filter"))

    def core(self, view):
        # Either of the two is latched off the valley: if both are, the voltage is early.
        out = {"tau": skewed(view), "angle": angle_error(view, view.omega)}
        chord = _ripples(view)["pulses"]
        if chord.any():
            out["pulses"] = current_error(view, zero_vector_slope(view) + chord)
        return out

    def free(self, view):
        columns = _ripples(view)
        if not columns["pulses"].any():
            return {}
        return {
            "shift": current_error(view, zero_vector_slope(view) + columns["shift"]),
            "filter": current_error(view, columns["shift"]),  # in front of the converters: it delays the ripple
        }

    def size(self, c, nominal):
        return max(abs(c.get("tau", 0.0)), abs(c.get("angle", 0.0)), abs(c.get("pulses", 0.0) + c.get("shift", 0.0)))

    def floor(self, nominal):
        return 0.0012 * nominal.sample_time_s

    def relevant(self, nominal):
        """As of a delay of the voltage, which leaves the same on the d axis."""
        return RELEVANT_PERIODS * nominal.sample_time_s

    def ceiling(self, nominal):
        return ROW * nominal.sample_time_s

    def too_large(self, c, view):
        """The ripple is that of another instant: its columns fit something else; only an angle may be later."""
        row = view.sample_time_s
        at = (c.get("pulses", 0.0) + c.get("shift", 0.0)) / row
        if c.get("pulses") and abs(at - view.memo["off_valley"]) > NEAR:
            return True
        late = max(ROW * row, LATE / max(view.top_speed, 1e-9))
        return abs(c.get("angle", 0.0)) > late or self.size({**c, "angle": 0.0}, view.nominal) > OFF_VALLEY * row

    def doubt(self, c, view):
        seen = current_error(view, self._pulses(c, view))["u"]
        return RIPPLE * np.sqrt(np.mean(np.abs(seen) ** 2, axis=1))

    @staticmethod
    def _pulses(c, view):
        """Current of the pulses (b, m+1) [A]."""
        if not c.get("pulses"):
            return np.zeros_like(view.i)
        columns = _ripples(view)
        return c["pulses"] * columns["pulses"] + (c.get("shift", 0.0) + c.get("filter", 0.0)) * columns["shift"]

    def corrected(self, view, c):
        turned = view.turned(c.get("angle", 0.0) * view.omega)
        late = c.get("tau", 0.0) + c.get("pulses", 0.0) + c.get("shift", 0.0)
        pulses = self._pulses(c, turned)
        return _without(turned, late * zero_vector_slope(turned) + pulses) if late else turned

    def estimates(self, c, covariance, nominal):
        # Currents relative to the angle, whichever of the two is latched off the valley.
        weights = np.array([WEIGHTS[name] for name in c])
        spread = np.sqrt(max(weights @ covariance @ weights, 0.0))
        return one("skew_s", "s", sum(WEIGHTS[name] * value for name, value in c.items()), spread)

    def given(self, view, plant):
        late = plant.timing.sampling_skew_s
        if not late:
            return {}
        return current_error(view, late * zero_vector_slope(view) + off_valley(view, late / view.sample_time_s))

    def plant(self, c, nominal):
        skew = c.get("tau", 0.0) + c.get("pulses", 0.0) + c.get("shift", 0.0)
        late = -c.get("angle", 0.0)
        return {"timing.angle_delay_s": late} if late else {"timing.sampling_skew_s": skew}


EFFECT = SamplingSkew(
    name="sampling_skew",
    title="skew between currents and angle",
    equation="i_measured = i(t + tau), di/dt = -(R i + j omega psi_m) / L, or theta_measured = theta(t - tau)",
    signature="order 0: omega^2 psi_m tau on the d axis, equivalent to an iron loss of R_fe = -L_q / tau",
    separated_by="load (an iron loss also follows omega^2 i_q); a deliberately shifted sampling trigger",
    parameters=(
        Parameter("skew_s", "s", "positive: currents sampled after the angle", "angle late by", "angle early by"),
    ),
    needs=("harmonics", "inverter"),
)
