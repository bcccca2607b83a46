# SPDX-License-Identifier: BSD-3-Clause
"""Clarke and Park transforms, amplitude invariant, alpha on phase a."""

import math

from fluxproof.plant.jit import njit

SQRT3 = math.sqrt(3.0)


@njit
def clarke(a, b, c):
    """Phase values to (alpha, beta); the zero sequence cancels."""
    return (2.0 * a - b - c) / 3.0, (b - c) / SQRT3


@njit
def inverse_clarke(alpha, beta):
    """(alpha, beta) to phase values of zero sum."""
    half = 0.5 * SQRT3 * beta
    return alpha, half - 0.5 * alpha, -half - 0.5 * alpha


@njit
def phase_matrix(r_a, r_b, r_c):
    """Resistances of the phases [ohm] to the symmetric 2x2 stator-frame matrix.

    Clarke of (r_k i_k) for currents of zero sum.  Equal values return exactly
    (r, 0, r): only the deviations from phase a are transformed.
    """
    d_b, d_c = r_b - r_a, r_c - r_a
    return r_a + (d_b + d_c) / 6.0, (d_c - d_b) / (2.0 * SQRT3), r_a + 0.5 * (d_b + d_c)
