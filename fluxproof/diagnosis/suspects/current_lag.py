# SPDX-License-Identifier: BSD-3-Clause
"""Measured currents that are late against angle and voltage, as behind a filter in front of the converters."""

import numpy as np

from fluxproof.diagnosis.effects import MeasurementError, Parameter, current_error, one, sigma


def _slope(view):
    """Slope of the measured current in the stator frame, in dq at the angle of the sample, (b, m+1) [A/s]."""
    return np.gradient(view.i, axis=1) / view.sample_time_s + 1j * view.omega * view.i


class CurrentLag(MeasurementError):
    def core(self, view):
        return {"tau": current_error(view, -_slope(view))}

    def floor(self, nominal):
        return 0.006 * nominal.sample_time_s

    def ceiling(self, nominal):
        return 2.0 * nominal.sample_time_s

    def possible(self, c, covariance, nominal):
        return c["tau"] >= 0.0

    def corrected(self, view, c):
        return view.without_current(view.phases(-c["tau"] * _slope(view)))

    def estimates(self, c, covariance, nominal):
        return one("tau_s", "s", c["tau"], sigma(covariance))


EFFECT = CurrentLag(
    name="current_lag",
    title="currents delayed by a filter",
    clause="the measured currents were delayed, as by a filter before the converters",
    equation="i_measured + tau di_measured/dt = i",
    signature="order 0: the whole current vector rotated by omega tau, and smaller by its square",
    separated_by="load at two speeds; a step of the current",
    parameters=(Parameter("tau_s", "s", "time constant"),),
    needs=("samples", "current"),
)
