# SPDX-License-Identifier: BSD-3-Clause
"""Basis functions of the free curves."""

import numpy as np


def hats(x, knots):
    """Piecewise-linear hat functions on the knots, one per knot but the first: (k - 1, *x.shape).

    Their linear combinations are all piecewise-linear functions that are zero at the first knot.
    """
    knots = np.asarray(knots, float)
    eye = np.eye(len(knots))
    return np.array([np.interp(x, knots, eye[k]) for k in range(1, len(knots))])


def parabola(values):
    """Least-squares parabola of each row of (b, k) values."""
    x = np.linspace(-1.0, 1.0, values.shape[1])
    basis, _ = np.linalg.qr(np.stack([np.ones_like(x), x, x**2], axis=1))
    return (values @ basis) @ basis.T


# Denser at the start, where warming is fastest.
COURSE_KNOTS = np.array([0.0, 0.08, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0])
BENDS = len(COURSE_KNOTS) - 2  # knots between the ends


def courses(view):
    """Slow drifts over time (knots - 1, b), piecewise linear and zero at the start of the recording."""
    return hats(view.course, COURSE_KNOTS)


def step_at_start(c) -> float:
    """Step of a free drift at the start, relative to the extrapolation of its next segment; c: of ``courses``."""
    first, second = c.get("course_0", 0.0), c.get("course_1", 0.0)
    return first - (second - first) * COURSE_KNOTS[1] / (COURSE_KNOTS[2] - COURSE_KNOTS[1])


def course(view):
    """Time relative to the length of the recording, (b, 1)."""
    return view.course[:, None]


def known_temperature(view, least_k=3.0):
    """Whether a winding temperature was recorded and changed by ``least_k`` [K]."""
    seen = view.temp[np.isfinite(view.temp)]
    return len(seen) == len(view.temp) and len(seen) > 0 and np.ptp(seen) >= least_k


def reference_c(nominal) -> float:
    """Temperature of the nameplate values [degC]."""
    return float(nominal.machine.temperature_ref_c)
