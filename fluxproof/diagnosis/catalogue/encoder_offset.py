# SPDX-License-Identifier: BSD-3-Clause
"""Constant offset of the measured angle."""

import numpy as np

from fluxproof.diagnosis.balance.curves import course
from fluxproof.diagnosis.effects import (
    Constant,
    FarStart,
    FreeCurve,
    MeasurementError,
    Parameter,
    angle_error,
    one,
    sigma,
)


class EncoderOffset(MeasurementError, FreeCurve, Constant, FarStart):
    rescales = ("theta_e",)
    exact = False
    starts = tuple({"offset": n * np.pi / 4} for n in (-3, -2, -1, 1, 2, 3, 4))

    def core(self, view):
        return {"offset": angle_error(view, np.ones_like(view.theta))}

    def free(self, view):
        return {"creep": angle_error(view, course(view) * np.ones_like(view.theta))}

    def floor(self, nominal):
        return 0.004

    def ceiling(self, nominal):
        return 0.8

    def too_large(self, c, view):
        return abs(c["offset"]) > np.pi

    def corrected(self, view, c):
        return view.turned(c["offset"] + c.get("creep", 0.0) * course(view))

    def estimates(self, c, covariance, nominal):
        return one("offset_rad", "rad", c["offset"], sigma(covariance))

    def plant(self, c, nominal):
        return {"sensors.position_offset_rad": c["offset"] / nominal.machine.pole_pairs}


EFFECT = EncoderOffset(
    name="encoder_offset",
    title="encoder offset",
    equation="theta_measured = theta_e + offset",
    signature="order 0: omega psi_m offset on the d axis, also at zero current",
    separated_by="rotation at zero current in both directions, two speeds",
    parameters=(Parameter("offset_rad", "rad", "electrical, measured minus true", "offset"),),
    needs=("angle",),
)
