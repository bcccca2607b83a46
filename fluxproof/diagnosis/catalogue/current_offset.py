# SPDX-License-Identifier: BSD-3-Clause
"""Offsets of the current sensors."""

import numpy as np

from fluxproof.diagnosis.effects import Caveat, FreeCurve, MeasurementError, Orders, Parameter, current_error
from fluxproof.diagnosis.ground.result import Estimate
from fluxproof.plant.transforms import AXES, PATTERNS

PHASES = "abc"


def _unit(view, k):
    """One ampere in phase k, in dq at the samples."""
    return (2 / 3) * AXES[k] * np.exp(-1j * view.theta)


def offset_column(view, weights, course=1.0):
    """Column of offsets with the given weights of the three phases, times a course over time, (b, 1) or 1."""
    error = sum(w * _unit(view, k) for k, w in enumerate(weights)) * course
    column = current_error(view, error)
    if view.has_sum:
        column["sum"] = sum(weights) * course * np.ones(view.u_dc.shape)
    return column


# The common mode appears in the sum only; in dq the other two rotate at the electrical frequency.
OFFSETS = {**PATTERNS, "zero": (1.0, 1.0, 1.0)}


class CurrentOffset(MeasurementError, FreeCurve, Caveat):
    def _patterns(self, view):
        return {k: w for k, w in OFFSETS.items() if k != "zero" or view.has_sum}

    def core(self, view):
        return {name: offset_column(view, w) for name, w in self._patterns(view).items()}

    def free(self, view):
        course = view.course[:, None]
        return {f"{name}_drift": offset_column(view, w, course) for name, w in self._patterns(view).items()}

    def floor(self, nominal):
        return 0.0015 * nominal.machine.rated_current_a

    def ceiling(self, nominal):
        return 0.4 * nominal.machine.rated_current_a

    def size(self, c, nominal):
        return float(np.max(np.abs(self._phases(c))))

    @staticmethod
    def _phases(c, suffix="") -> np.ndarray:
        return sum((c.get(name + suffix, 0.0) * np.array(w) for name, w in OFFSETS.items()), np.zeros(3))

    def corrected(self, view, c):
        course = view.course[:, None, None]
        error = self._phases(c) + self._phases(c, "_drift") * course  # (b, 1, 3) or (3,)
        error = np.broadcast_to(error, (len(view), view.theta.shape[1], 3))
        return view.without_current(error)

    def estimates(self, c, covariance, nominal):
        names = list(c)
        out = {}
        for k, phase in enumerate(PHASES):
            weights = np.array([OFFSETS[name][k] if name in OFFSETS else 0.0 for name in names])
            spread = float(np.sqrt(max(weights @ covariance @ weights, 0.0)))
            out[f"offset_{phase}_a"] = Estimate(float(self._phases(c)[k]), spread, "A")
        return out

    def caveat(self, view, c):
        if view.has_sum:
            return ""
        return (
            "The offsets are given with a sum of zero: this recording does not show an equal offset of all three "
            "sensors, which would add to each."
        )

    def plant(self, c, nominal):
        return {"sensors.current_offset_a": [float(v) for v in self._phases(c)]}


EFFECT = CurrentOffset(
    name="current_offset",
    title="offsets of the current sensors",
    equation="i_measured = i + o_abc",
    signature="order 1 in dq (R o, constant in the stator frame); phase currents that do not sum to zero",
    separated_by="a log at zero current, gates off",
    parameters=tuple(Parameter(f"offset_{x}_a", "A", f"phase {x}, measured minus true", f"phase {x}") for x in PHASES),
    plausible={f"offset_{x}_a": (-0.1, 0.1, "machine.rated_current_a") for x in PHASES},
    otherwise="a wrong offset code, or a magnetised current sensor",
    needs=("harmonics", "current"),
    shows_at=Orders((1.0,)),
)
