# SPDX-License-Identifier: BSD-3-Clause
"""A gain of all current sensors that drifts over the recording, as of a shunt or an amplifier that warms up."""

import numpy as np

from fluxproof.diagnosis.balance.curves import BENDS, course, courses
from fluxproof.diagnosis.effects import FreeCurve, MeasurementError, Parameter, current_error, one, sigma


class CurrentGainDrift(MeasurementError, FreeCurve):
    def core(self, view):
        return {"drift": current_error(view, view.i * course(view))}

    def free(self, view):
        bends = courses(view)[:BENDS, :, None]
        return {f"course_{k}": current_error(view, view.i * bend) for k, bend in enumerate(bends)}

    def size(self, c, nominal):
        return abs(c["drift"])

    def floor(self, nominal):
        return 0.006

    def ceiling(self, nominal):
        return 0.3

    def corrected(self, view, c):
        drift = c["drift"] * course(view) * np.ones_like(view.theta)
        for k, bend in enumerate(courses(view)[:BENDS, :, None]):
            drift = drift + c.get(f"course_{k}", 0.0) * bend
        factor = 1.0 / (1.0 + drift)
        return view.replace(
            i=view.i * factor,
            i_raw=view.i_raw * factor,
            i_abc=None if view.i_abc is None else view.i_abc * factor[..., None],
        )

    def estimates(self, c, covariance, nominal):
        return one("drift", "1", c["drift"], sigma(covariance))


EFFECT = CurrentGainDrift(
    name="current_gain_drift",
    title="drifting gain of all current sensors",
    clause="the gain of all current sensors drifted over the recording, as with a shunt that warms up",
    equation="i_measured = (1 + s t) i, with t from 0 to 1 over the recording",
    signature="R, L_d and L_q drift by the same factor",
    separated_by="the same operating point at the start and at the end",
    plausible={"drift": (-0.03, 0.03)},  # a shunt or a Hall sensor that warms by 100 K
    otherwise="the machine warms, or another range of the sensors was chosen",
    parameters=(Parameter("drift", "1", "change of the gain over the recording"),),
    needs=("current", "time"),
)
