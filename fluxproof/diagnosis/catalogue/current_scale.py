# SPDX-License-Identifier: BSD-3-Clause
"""A common gain error of all current sensors.

The coefficient is the share a of the measured current that is not there, i = (1 - a) i_measured, since the balance is
linear in it at any size; the scale is s = a / (1 - a).
"""

import numpy as np

from fluxproof.diagnosis.catalogue.current_gain import gain_column
from fluxproof.diagnosis.effects import Constant, FreeCurve, MeasurementError, Parameter, current_error, one, sigma

LARGEST_SCALE, SMALLEST_SCALE = 2.5, -0.75  # the sensors of a drive that runs are right within a factor of 3.5


def _scale(c) -> float:
    return c["share"] / (1.0 - c["share"])


class CurrentScale(MeasurementError, FreeCurve, Constant):
    rescales = ("i",)

    def core(self, view):
        column = gain_column(view, (1.0, 1.0, 1.0)) if view.has_sum else current_error(view, view.i)
        return {"share": {channel: x / view.current_kept for channel, x in column.items()}}

    def free(self, view):
        return {"droop": current_error(view, view.i * np.abs(view.i / view.machine.rated_current_a) ** 2)}

    def floor(self, nominal):
        return 0.004

    def ceiling(self, nominal):
        return 0.6

    def too_large(self, c, view):
        return c["share"] >= 1.0 or not SMALLEST_SCALE < _scale(c) < LARGEST_SCALE

    def corrected(self, view, c):
        rated = view.machine.rated_current_a
        kept = 1.0 - min(c["share"], LARGEST_SCALE / (1.0 + LARGEST_SCALE))
        factor = kept / (1.0 + kept * c.get("droop", 0.0) * np.abs(view.i / rated) ** 2)
        return view.replace(
            i=view.i * factor,
            i_raw=view.i_raw * factor,
            i_abc=None if view.i_abc is None else view.i_abc * factor[..., None],
            current_kept=view.current_kept * kept,
        )

    def estimates(self, c, covariance, nominal):
        return one("scale", "1", _scale(c), sigma(covariance) / (1.0 - c["share"]) ** 2)

    def plant(self, c, nominal):
        return {"sensors.current_gain_error": [_scale(c)] * 3}


EFFECT = CurrentScale(
    name="current_scale",
    title="common gain error of the current sensors",
    equation="i_measured = (1 + s) i",
    signature="R, L_d and L_q wrong by the same factor",
    separated_by="an external ammeter or a torque transducer",
    beside_torque="an external ammeter, or an EMF run without current, which measures the flux",
    parameters=(Parameter("scale", "1", "relative error of all phases", "error"),),
    plausible={"scale": (-0.1, 0.1)},
    otherwise="rms values in place of peak values, or the scale of another range of the sensors",
    needs=("current",),
)
